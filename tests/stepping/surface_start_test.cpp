// Surfaces that start pierced, on each other or inside: they come apart gently, or stay.
#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"
#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

TEST(SurfaceContact, WhatStartsPiercedComesApartGently) {
  SurfaceBodies bodies;
  const TetMesh ball = make_ball(0.3, 2);
  bodies.add(ball, 10, 1, {.shift = {-0.22, 0, 0}});
  bodies.add(ball, 10, 1, {.shift = {0.22, 0.03, 0.01}});
  ASSERT_GT(bodies.crossings(), 0);
  Real fastest = 0;
  int apart = -1;
  for (int k = 0; k < 90; ++k) {
    bodies.step();
    for (int b = 0; b < 2; ++b) fastest = std::max(fastest, (bodies[b].particles().velocities.rowwise().mean()).norm());
    if (apart < 0 && bodies.crossings() == 0) apart = k;
    if (apart >= 0) {
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    }
  }
  EXPECT_GE(apart, 0);
  EXPECT_LT(2 * fastest, 0.5);  // of one against the other
  EXPECT_LT(bodies.momentum().linear.norm(), 1e-14);
  EXPECT_LT(bodies.momentum().angular.norm(), 1e-14);
  EXPECT_GT(least_distance(bodies.skins(), false), 0.9 * bodies.margin);
}

TEST(SurfaceContact, WhatStartsPiercedDeeplyIsNotTornApart) {
  // Half way through each other: they may stay, but not take energy from the way out.
  for (const Real stiffness : {5.0, 50.0}) {
    SurfaceBodies bodies;
    const TetMesh ball = make_ball(0.3, 2);
    bodies.add(ball, stiffness, 1, {.shift = {-0.1, 0, 0}});
    bodies.add(ball, stiffness, 1, {.shift = {0.1, 0.03, 0.01}});
    for (int k = 0; k < 120; ++k) {
      bodies.step();
      ASSERT_LT(bodies.energy(), 0.5) << "frame " << k;  // of 2 kg
    }
    EXPECT_LT(bodies.momentum().linear.norm(), 1e-13);
    EXPECT_LT(bodies.momentum().angular.norm(), 1e-13);
  }
}

TEST(SurfaceContact, BoxesWhoseFacesCoincideAreBesideEachOther) {
  // No distance, no direction: the outside of a closed surface decides.
  SurfaceBodies bodies;
  bodies.gravity = {0, -9.81, 0};
  bodies.floors = {0};
  bodies.damping_time = 0.02;
  const TetMesh box = make_box({0.5, 0.5, 0.5}, {2, 2, 2});
  bodies.add(box, 100, 1, {.shift = {0, 0.01, 0}});
  bodies.add(box, 100, 1, {.shift = {0, 0.51, 0}});
  for (int k = 0; k < 90; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
  }
  EXPECT_GT(least_distance(bodies.skins(), false), 0.9 * bodies.margin);
}

TEST(SurfaceContact, WhatIsInsideAClosedSurfaceIsHeldInside) {
  // A ball in a hollow one, thrown at its wall.
  SurfaceBodies bodies;
  bodies.add_cloth(penalty::make_sphere(1, 6), 10, 1e-3, 1);
  bodies.add(make_ball(0.3, 2), 10, 1, {.shift = {0.1, 0, 0}, .velocity = {5, 2, 1}});
  const Momentum start = bodies.momentum();
  const Real energy = bodies.energy();
  for (int k = 0; k < 60; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
  }
  const auto center = [&](int k) { return Vector3(bodies[k].particles().positions.rowwise().mean().head<3>()); };
  EXPECT_LT((center(1) - center(0)).norm(), 1);
  EXPECT_GT(center(0).norm(), 0.5) << "is carried along";
  EXPECT_LT((bodies.momentum().linear - start.linear).norm(), 1e-13);
  EXPECT_LE(bodies.energy(), energy);
}

}  // namespace
}  // namespace penalty::testing
