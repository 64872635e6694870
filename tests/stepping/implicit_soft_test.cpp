// Soft bodies that touch each other in the implicit step: measured from positions and velocities alone.
#include "penalty/mesh/builders.h"
#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

Vector3 center_of_particles(const Body& body) { return body.particles().positions.rowwise().mean().head<3>(); }

bool is_implicit(SurfaceBodies& bodies, std::size_t k = 0) {
  return bodies[k].body.report.integrator == Integrator::implicit_step;
}

// Bodies that are to lie on the floor, or on each other.
SurfaceBodies on_the_floor() {
  SurfaceBodies bodies;
  bodies.integrator = Integrator::implicit_step;
  bodies.friction = 0.5;
  bodies.gravity = {0, -g, 0};
  bodies.floors = {0};
  return bodies;
}

TEST(ImplicitSoft, ACentralHitIsPerfectlyPlastic) {
  // By contacts of particles with particles; 1 kg at 3 m/s on 2 kg at rest. What is slower than 1e-4 m/s counts as settled.
  Body left = make_free_particles(Eigen::Matrix3Xd(Vector3(-0.02, 0, 0)), {1});
  Body right = make_free_particles(Eigen::Matrix3Xd(Vector3(0, 0, 0)), {2});
  left.set_velocity(0, {3, 0, 0});
  left.body.options.integrator = right.body.options.integrator = Integrator::implicit_step;
  left.contacts = {{.a = Side::of_particles(0, WeightedPoint::at_particle(0)),
                    .b = Side::of_particles(1, WeightedPoint::at_particle(0)),
                    .normal = {-1, 0, 0}}};
  for (int step = 0; step < 30; ++step) advance({&left, &right}, frame);
  EXPECT_EQ(left.body.report.integrator, Integrator::implicit_step);
  EXPECT_LT((left.velocity(0) - Vector3(1, 0, 0)).norm(), 1e-4);
  EXPECT_LT((right.velocity(0) - Vector3(1, 0, 0)).norm(), 1e-4);
  EXPECT_LT((left.velocity(0) + 2 * right.velocity(0) - Vector3(3, 0, 0)).norm(), 1e-13);
  EXPECT_LT((left.position(0) - right.position(0)).norm(), 1e-4);
}

TEST(ImplicitSoft, StackedBoxesStandStillOnEachOther) {
  for (const Real stiffness : {1e2, 1e4, 1e6}) {
    SCOPED_TRACE(stiffness);
    SurfaceBodies bodies = on_the_floor();
    const TetMesh box = make_box({1, 1, 1}, {3, 3, 3});
    for (int k = 0; k < 3; ++k) bodies.add(box, stiffness, 10, {.shift = {0, 0.02 + 1.03 * k, 0}});
    const Real start = bodies.energy();
    Real last = start, gain = 0;
    for (int k = 0; k < 240; ++k) {
      bodies.step();
      ASSERT_TRUE(is_implicit(bodies));
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
      gain = std::max(gain, bodies.energy() - last);
      last = bodies.energy();
    }
    EXPECT_LT(gain, 1e-3 * start);
    EXPECT_LT(bodies.kinetic_energy(), 1e-5 * 10 * g * 0.04) << "of what the fall gave";
    EXPECT_GT(least_distance(bodies.skins(), false), 0.97 * bodies.margin);
    for (int k = 0; k < 3; ++k)
      EXPECT_LT((center_of_particles(bodies[k]) - Vector3(0.5, 0.5 + k, 0.5)).norm(), 0.05) << "box " << k;
  }
}

TEST(ImplicitSoft, TheHeavyDoesNotCrushTheLight) {
  // 100 kg, as stiff for its weight, on 1 kg: what is below is a hundredth of the elastic energy per displacement.
  for (const Real stiffness : {1e4, 1e6}) {
    SCOPED_TRACE(stiffness);
    SurfaceBodies bodies = on_the_floor();
    const TetMesh box = make_box({1, 1, 1}, {3, 3, 3});
    bodies.add(box, stiffness, 1, {.shift = {0, 0.02, 0}});
    bodies.add(box, 100 * stiffness, 100, {.shift = {0.05, 1.1, 0.03}});
    for (int k = 0; k < 240; ++k) {
      bodies.step();
      ASSERT_TRUE(is_implicit(bodies));
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    }
    EXPECT_LT(bodies.kinetic_energy(), 1e-5 * 100 * g * 0.07);
    EXPECT_GT(least_distance(bodies.skins(), false), 0.9 * bodies.margin);
  }
}

TEST(ImplicitSoft, WhatCrushesTheLightGainsNoEnergy) {
  // Ten tonnes on 1 kg that can store a thousandth of their fall: what no implicit step can do without gain is left to substeps.
  SurfaceBodies bodies = on_the_floor();
  const TetMesh box = make_box({1, 1, 1}, {3, 3, 3});
  bodies.add(box, 1e2, 1, {.shift = {0, 0.02, 0}});
  bodies.add(box, 1e6, 1e4, {.shift = {0.05, 1.1, 0.03}});
  const Real start = bodies.energy();
  for (int k = 0; k < 24; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    ASSERT_LE(bodies.energy(), 1.01 * start) << "frame " << k;
  }
}

TEST(ImplicitSoft, WhatFallsFromRestIsMetInTheFirstStep) {
  // So small that gravity alone takes it through all that is below in one step: velocities say nothing of that.
  for (const Real size : {1e-3, 1e-2}) {
    SCOPED_TRACE(size);
    SurfaceBodies bodies = on_the_floor();
    bodies.margin = 0.02 * size;
    const TetMesh box = make_box({size, size, size}, {3, 3, 3});
    const Real mass = 1000 * size * size * size, stiffness = 100 * mass * g * size;
    bodies.add(box, stiffness, mass, {.shift = {0, 0.02 * size, 0}});
    bodies.add(box, stiffness, mass, {.shift = size * Vector3(0.05, 1.2, 0.1)});
    for (int k = 0; k < 30; ++k) {
      bodies.step();
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    }
    EXPECT_NEAR(center_of_particles(bodies[1]).y(), 1.53 * size, 0.02 * size);
    EXPECT_GT(least_distance(bodies.skins(), false), 0.97 * bodies.margin);
  }
}

TEST(ImplicitSoft, AnAutomaticBodyThatWouldBeMetUnforeseenIsLeftToTheSubsteps) {
  // As stiff as it takes for an implicit step in free flight; it still rises, but in one step falls far into what lies below.
  const Real size = 1e-2;
  SurfaceBodies bodies;
  bodies.margin = 0.02 * size;
  bodies.gravity = {0, -g, 0};
  const TetMesh box = make_box({size, size, size}, {3, 3, 3});
  Body& below = bodies.add(box, 2.5e-3, 1e-3);
  std::ranges::fill(below.particles().inverse_masses, 0);
  Body& above = bodies.add(box, 2.5e-3, 1e-3, {.shift = size * Vector3(0.05, 1.15, 0.1), .velocity = {0, 0.05, 0}});
  ASSERT_GT(frame * std::sqrt(above.body.largest_eigenvalue) / 2, 100) << "substeps that it needs";
  bodies.step();
  EXPECT_FALSE(is_implicit(bodies, 1));
  EXPECT_EQ(bodies.crossings(), 0);
  EXPECT_GT(least_distance(bodies.skins(), false), 0.9 * bodies.margin);
}

TEST(ImplicitSoft, BodiesOfOneIslandThatDoNotTouchMoveAsIfAlone) {
  const auto velocities_of_first = [](bool both) {
    SurfaceBodies bodies;
    bodies.integrator = Integrator::implicit_step;
    bodies.gravity = {0, -g, 0};
    const TetMesh box = make_box({1, 1, 1}, {2, 2, 2});
    const Matrix3 turned = Eigen::AngleAxis<Real>(0.3, Vector3::UnitX()).toRotationMatrix();
    bodies.add(box, 100, 10, {.velocity = {1, 2, 3}});
    if (both) bodies.add(box, 1000, 1, {.shift = {0, 5, 0}, .velocity = {0, 0, 1}, .rotation = turned});
    Particles& particles = bodies[0].particles();
    for (int i = 0; i < particles.size(); ++i)
      particles.velocities.col(i).head<3>() += Vector3(0, 0, 5).cross(Vector3(particles.positions.col(i).head<3>()));
    bodies.step(frame, 10);
    return particles.velocities;
  };
  const PackedVectors alone = velocities_of_first(false), together = velocities_of_first(true);
  EXPECT_LT((alone - together).norm(), 1e-4 * alone.norm());  // Newton's method ends when all are good enough
}

}  // namespace
}  // namespace penalty::testing
