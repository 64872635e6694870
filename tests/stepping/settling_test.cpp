// What lies comes to rest, and nothing else does.
#include <numbers>

#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

constexpr Material stiff{.young = 1e6, .poisson = 0.35};  // for its size of a metre

// The largest speed of a particle over a step, from positions: what is seen to move.
Real largest_motion(SurfaceBodies& bodies, int count) {
  std::vector<PackedVectors> before;
  before.reserve(count);
  for (int k = 0; k < count; ++k) before.push_back(bodies[k].particles().positions);
  bodies.step();
  Real largest = 0;
  for (int k = 0; k < count; ++k)
    largest = std::max(largest, (bodies[k].particles().positions - before[k]).colwise().norm().maxCoeff() * 60);
  return largest;
}

Real largest_speed(SurfaceBodies& bodies, int count) {
  Real largest = 0;
  for (int k = 0; k < count; ++k)
    largest = std::max(largest, bodies[k].particles().velocities.colwise().norm().maxCoeff());
  return largest;
}

// Stands on a floor of friction, under gravity of the earth.
SurfaceBodies standing(Real size, Real damping_time) {
  SurfaceBodies bodies;
  bodies.margin = 0.01 * size;
  bodies.friction = 0.6;
  bodies.gravity = {0, -9.81, 0};
  bodies.floors = {0};
  bodies.damping_time = damping_time;
  return bodies;
}

TEST(Settling, OfATowerThatSwaysTakesThreeSeconds) {
  for (const Real size : {0.01, 1.0, 100.0}) {
    SCOPED_TRACE("size " + std::to_string(size));
    const Real slowness = std::sqrt(size);  // of what gravity makes of it
    SurfaceBodies bodies = standing(size, 0.02 * slowness);
    const Real mass = 300 * size * size * size;
    const TetMesh mesh = make_box({size, 3 * size, size}, {3, 9, 3});
    Body& tower = bodies.add(mesh, 0.5 * 9.81 * size * mass, mass, {.shift = {0, 0.005 * size, 0}});
    for (int i = 0; i < tower.particles().size(); ++i)
      tower.set_velocity(i, {slowness * mesh.vertices(1, i) / (3 * size), 0, 0});
    const int steps = static_cast<int>(180 * std::max<Real>(slowness, 1));
    bodies.step(1.0 / 60, steps);
    EXPECT_LT(largest_motion(bodies, 1), 0.005 * slowness);
    bodies.step(1.0 / 60, steps);
    EXPECT_LT(largest_motion(bodies, 1), 0.001 * slowness);
    EXPECT_LT(largest_speed(bodies, 1), 0.001 * slowness);
  }
}

TEST(Settling, OfThreeBoxesOnEachOtherTakesThreeSeconds) {
  SurfaceBodies bodies = standing(1, 0.02);
  for (int k = 0; k < 3; ++k) bodies.add(make_box({1, 1, 1}, {3, 3, 3}), 100, 10, {.shift = {0, 0.02 + 1.03 * k, 0}});
  bodies.step(1.0 / 60, 180);
  EXPECT_LT(largest_motion(bodies, 3), 0.005);
  bodies.step(1.0 / 60, 180);
  EXPECT_LT(largest_motion(bodies, 3), 0.001);
  EXPECT_LT(largest_speed(bodies, 3), 0.001);
}

TEST(Settling, LetsACubeBounceToAThirdOfItsFall) {
  SurfaceBodies bodies = standing(1, 0.005);
  Body& cube = bodies.add(make_box({1, 1, 1}, {4, 4, 4}), 1000, 10, {.shift = {0, 0.505, 0}});
  Real highest = 0;
  for (int k = 0; k < 60; ++k) {
    bodies.step();
    if (k > 30) highest = std::max(highest, cube.particles().positions.row(1).minCoeff() - bodies.margin / 2);
  }
  EXPECT_GT(highest, 0.5 / 3);
  EXPECT_LT(highest, 0.5);
}

// The fall, and what no material damps.
TEST(Settling, NeedsNoDamping) {
  SurfaceBodies bodies = standing(1, 0);
  bodies.add(make_box({1, 3, 1}, {3, 9, 3}), stiff, 3000, {.shift = {0, 0.05, 0}});
  bodies.step(1.0 / 60, 180);
  EXPECT_LT(largest_motion(bodies, 1), 0.005);
}

// With gaps, and not straight above each other.
TEST(Settling, OfAStackThatFellTakesThreeSeconds) {
  for (const Real size : {0.01, 1.0, 10.0}) {
    SCOPED_TRACE("size " + std::to_string(size));
    const Real slowness = std::sqrt(size);
    SurfaceBodies bodies = standing(size, 0.005 * slowness);
    for (int k = 0; k < 3; ++k)
      bodies.add(make_box({size, size, size}, {3, 3, 3}), {.young = 1e6 * size, .poisson = 0.35},
                 1000 * size * size * size,
                 {.shift = {0.05 * size * (k % 2), (0.05 + 1.05 * k) * size, 0.03 * size * (k % 3)}});
    bodies.step(1.0 / 60, static_cast<int>(180 * slowness));
    for (int k = 0; k < 60; ++k) EXPECT_LT(largest_motion(bodies, 3), 0.005 * slowness) << k;
  }
}

// Two boxes, one on the other, and no friction with the floor.
SurfaceBodies two_on_ice() {
  SurfaceBodies bodies = standing(1, 0.005);
  for (int k = 0; k < 2; ++k)
    bodies.add(make_box({1, 1, 1}, {3, 3, 3}), stiff, 1000, {.shift = {0, 0.005 + 1.01 * k, 0}});
  bodies.friction = 0;
  return bodies;
}

TEST(Settling, LeavesAStackThatSlidesAlone) {
  SurfaceBodies bodies = two_on_ice();
  bodies.step(1.0 / 60, 60);
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < bodies[k].particles().size(); ++i)
      bodies[k].set_velocity(i, bodies[k].velocity(i) + Vector3(0.05, 0, 0.02));
  const Vector3 before = bodies.momentum().linear;
  const auto drag = [&] { return bodies[0].body.flows.drag + bodies[1].body.flows.drag; };
  const Real drag_before = drag();
  bodies.step(1.0 / 60, 120);
  const Vector3 after = bodies.momentum().linear;
  EXPECT_NEAR(after.x(), before.x(), 1e-9);
  EXPECT_NEAR(after.z(), before.z(), 1e-9);
  EXPECT_GT(drag(), drag_before) << "what deforms them is damped";
}

TEST(Settling, LeavesAStackThatTurnsAlone) {
  SurfaceBodies bodies = two_on_ice();
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < bodies[k].particles().size(); ++i)
      bodies[k].set_velocity(i, Vector3(0, 0.1, 0).cross(bodies[k].position(i)));
  const Real before = bodies.momentum().angular.y();
  ASSERT_GT(before, 30);
  bodies.step(1.0 / 60, 120);
  EXPECT_NEAR(bodies.momentum().angular.y(), before, 1e-3 * before);
  EXPECT_GT(bodies[1].body.flows.drag, 0);
}

TEST(Settling, LeavesABallThatRollsAlone) {
  const auto way = [](Real settling_speed) {
    SurfaceBodies bodies = standing(1, 0.005);
    Body& ball = bodies.add(make_ball(0.5, 6), {.young = 1e7, .poisson = 0.35}, 520, {.shift = {0, 0.505, 0}});
    ball.body.options.settling_speed = settling_speed;
    for (int i = 0; i < ball.particles().size(); ++i)
      ball.set_velocity(i, Vector3(0.5, 0, 0) + Vector3(0, 0, -1).cross(ball.position(i) - Vector3(0, 0.505, 0)));
    const Real start = ball.particles().positions.row(0).mean();
    bodies.step(1.0 / 60, 180);
    return ball.particles().positions.row(0).mean() - start;
  };
  const Real free = way(0);
  EXPECT_GT(free, 1);
  EXPECT_NEAR(way(0.1), free, 0.05 * free);
}

// A box hits another from above, and below both there is nothing.
TEST(Settling, LeavesWhatNothingHoldsAlone) {
  SurfaceBodies bodies = standing(1, 0);
  bodies.floors = {};
  for (int k = 0; k < 2; ++k)
    bodies.add(make_box({1, 1, 1}, {3, 3, 3}), stiff, 1000,
               {.shift = {0, 1.03 * k, 0}, .velocity = {0, k == 0 ? 0.1 : -0.1, 0}});
  bodies.step(1.0 / 60, 60);
  EXPECT_GT(bodies[0].body.report.num_contacts + std::abs(bodies[0].body.flows.contacts), 0);
  for (int k = 0; k < 2; ++k) EXPECT_EQ(bodies[k].body.flows.drag, 0);
  EXPECT_NEAR(bodies.momentum().linear.y(), -9.81 * 2000, 1e-9 * 20000);
}

TEST(Settling, LeavesWhatSlidesAlone) {
  // Down a slope of 3 degrees without friction, in its frame.
  SurfaceBodies bodies = standing(1, 0.02);
  bodies.friction = 0;
  const Real slope = 3 * std::numbers::pi / 180;
  bodies.gravity = 9.81 * Vector3(std::sin(slope), -std::cos(slope), 0);
  Body& cube = bodies.add(make_box({1, 1, 1}, {3, 3, 3}), 100, 10, {.shift = {0, 0.005, 0}});
  bodies.step(1.0 / 60, 120);
  const Vector3 mean = cube.particles().velocities.rowwise().mean().head<3>();
  EXPECT_NEAR(mean.x(), 2 * bodies.gravity.x(), 1e-9);
}

}  // namespace
}  // namespace penalty::testing
