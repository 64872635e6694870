// Contacts between rigid bodies of an island, in closed form. A particle far away makes it an island.
#include <numbers>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

RigidBody cube(Real mass, Real size, const Vector3& position, const Vector3& velocity = Vector3::Zero()) {
  RigidBody body;
  body.position = position;
  body.velocity = velocity;
  body.inverse_mass = Vector3::Constant(1 / mass);
  body.inverse_inertia = Matrix3::Identity() * (6 / (mass * size * size));
  return body;
}

struct RigidIsland {
  Body particle = make_free_particles(Eigen::Matrix3Xd(Vector3(100, 0, 0)), {1});
  Island island;

  RigidIsland() { island.bodies = {&particle.body}; }
  RigidBody& operator[](std::size_t k) { return island.rigid_bodies[k]; }

  // The four lower corners of cube `a` on the top of `b`, where they are now.
  void stand(int a, int b, Real size, Real friction = 0, Real restitution = 0) {
    RigidBody &upper = island.rigid_bodies[a], &lower = island.rigid_bodies[b];
    for (const Real x : {-size / 2, size / 2})
      for (const Real z : {-size / 2, size / 2}) {
        const Vector3 corner = upper.position + upper.rotation * Vector3(x, -size / 2, z);
        const Vector3 under(corner.x(), lower.position.y() + size / 2, corner.z());
        island.rigid_contacts.push_back({.a = a,
                                         .b = b,
                                         .anchor_a = {x, -size / 2, z},
                                         .anchor_b = lower.rotation.transpose() * (under - lower.position),
                                         .friction = friction,
                                         .restitution = restitution});
      }
  }
  void step(int count = 1) {
    for (int k = 0; k < count; ++k) advance(island, frame);
  }
};

TEST(RigidContact, AHitKeepsTheMomentumAndGivesBackItsShare) {
  for (const Real restitution : {0.0, 0.5, 1.0}) {
    SCOPED_TRACE(restitution);
    RigidIsland s;
    s.island.rigid_bodies = {cube(1, 1, {0, 2, 0}, {0, -3, 0}), cube(2, 1, {0, 0, 0})};
    s.stand(0, 1, 1, 0, restitution);
    s.step(60);
    EXPECT_NEAR(s[0].velocity.y(), -1 + 2 * restitution, 1e-3);  // sweeps end
    EXPECT_NEAR(s[1].velocity.y(), -1 - restitution, 1e-3);
    EXPECT_LT(s[0].angular_velocity.norm() + s[1].angular_velocity.norm(), 2e-3);
    EXPECT_LT((s[0].velocity + 2 * s[1].velocity - Vector3(0, -3, 0)).norm(), 1e-13);
  }
}

TEST(RigidContact, AHitOffTheCentreKeepsBothMomenta) {
  RigidIsland s;
  s.island.rigid_bodies = {cube(1, 1, {0.4, 1.7, 0.3}, {0.5, -3, 0}), cube(2, 1, {0, 0, 0})};
  s[0].angular_velocity = {1, -2, 0.5};
  s.stand(0, 1, 1, 0.5);
  const Momentum before = momentum({}, s.island.rigid_bodies);
  s.step(30);
  const Momentum after = momentum({}, s.island.rigid_bodies);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-13);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12);
  EXPECT_GT(s[0].velocity.y(), -2.5) << "did not hit";
}

// The lightest carries 130 times its mass.
TEST(RigidContact, ATowerOfAnyMassesStaysWhereItIs) {
  RigidIsland s;
  RigidBody ground;
  s.island.rigid_bodies = {ground};
  const std::array masses{10.0, 1.0, 30.0, 100.0};
  for (std::size_t k = 0; k < masses.size(); ++k) {
    s.island.rigid_bodies.push_back(cube(masses[k], 1, {0, static_cast<Real>(k) + 1, 0}));
    s.island.rigid_bodies.back().acceleration = {0, -10, 0};
  }
  for (int k = 0; k < static_cast<int>(masses.size()); ++k) s.stand(k + 1, k, 1, 0.5);
  s.particle.body.options.substeps = 16;
  s.step(120);
  for (std::size_t k = 0; k < masses.size(); ++k) {
    EXPECT_LT((s[k + 1].position - Vector3(0, static_cast<Real>(k) + 1, 0)).norm(), 1e-3) << k;
    EXPECT_GT(s[k + 1].rotation(1, 1), 1 - 1e-6) << k;
  }
}

TEST(RigidContact, ACubeSlidesDownASlopeWithTheCoulombAcceleration) {
  const Real angle = std::numbers::pi / 6, gravity = 10;
  for (const Real friction : {0.0, 0.2, 0.6}) {
    SCOPED_TRACE(friction);
    RigidIsland s;
    s.island.rigid_bodies = {RigidBody(), cube(3, 0.2, {0, 0.2, 0})};
    s[1].acceleration = gravity * Vector3(std::sin(angle), -std::cos(angle), 0);
    s.particle.body.options.substeps = 8;
    const Real a = std::max<Real>(gravity * (std::sin(angle) - friction * std::cos(angle)), 0);
    for (int k = 0; k < 30; ++k) {
      s.island.rigid_contacts.clear();  // found anew in each step, as the corners slide on
      s.stand(1, 0, 0.2, friction);
      s.step();
    }
    EXPECT_NEAR(s[1].velocity.x(), a * 0.5, 0.01 * gravity * 0.5);
    EXPECT_NEAR(s[1].position.y(), 0.2, 1e-3);
  }
}

// Of a ball of mass m and radius r the force along the normal, times the coefficient, is the moment M against rolling: it
// takes M / r of what has the inertia of m + I / r² = 7/5 m.
class TurningBall : public ::testing::TestWithParam<Integrator> {};

TEST_P(TurningBall, IsBrakedByTheMomentAgainstRollingAndThenStays) {
  const Real gravity = 10, radius = 0.1, rolling = 0.02, speed = 1;
  RigidIsland s;
  s.island.rigid_bodies = {RigidBody(), make_sphere(3, radius, {0, radius, 0})};
  s[1].acceleration = {0, -gravity, 0};
  s[1].velocity = {speed, 0, 0};
  s[1].angular_velocity = {0, 0, -speed / radius};
  s.particle.body.options.substeps = 8;
  s.particle.body.options.integrator = GetParam();
  const Real braked = rolling * gravity / radius / 1.4;
  for (int k = 1; k <= 60; ++k) {
    const Vector3 x = s[1].position;
    s.island.rigid_contacts = {{.a = 1,
                                .b = 0,
                                .anchor_a = Vector3::Zero(),
                                .anchor_b = {x.x(), 0, x.z()},
                                .radius = radius,
                                .friction = 1,
                                .rolling = rolling}};
    s.step();
    ASSERT_EQ(s.particle.body.report.integrator, GetParam());
    EXPECT_NEAR(s[1].velocity.x(), std::max<Real>(speed - braked * k * frame, 0), 2e-3) << k;
    EXPECT_NEAR(s[1].angular_velocity.z() * radius, -s[1].velocity.x(), 2e-3) << k;
  }
  // Backward Euler goes on at the speed of the end of each step.
  const Real behind = GetParam() == Integrator::implicit_step ? speed * frame / 2 : 0;
  EXPECT_NEAR(s[1].position.x(), speed * speed / 2 / braked - behind, 5e-3);
}

TEST_P(TurningBall, IsBrakedByTheMomentAboutTheNormal) {
  const Real gravity = 10, radius = 0.1, spinning = 0.01, mass = 3, rate = 20;
  RigidIsland s;
  s.island.rigid_bodies = {RigidBody(), make_sphere(mass, radius, {0, radius, 0})};
  s[1].acceleration = {0, -gravity, 0};
  s[1].angular_velocity = {0, rate, 0};
  s.particle.body.options.substeps = 8;
  s.particle.body.options.integrator = GetParam();
  const Real braked = spinning * mass * gravity / (0.4 * mass * radius * radius);
  for (int k = 1; k <= 60; ++k) {
    s.island.rigid_contacts = {
        {.a = 1, .b = 0, .radius = radius, .friction = 1, .rolling = 1e-6, .spinning = spinning}};
    s.step();
    ASSERT_EQ(s.particle.body.report.integrator, GetParam());
    EXPECT_NEAR(s[1].angular_velocity.y(), std::max<Real>(rate - braked * k * frame, 0), 0.01 * rate) << k;
  }
  EXPECT_LT((s[1].position - Vector3(0, radius, 0)).norm(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(RigidContact, TurningBall,
                         ::testing::Values(Integrator::explicit_step, Integrator::implicit_step));

}  // namespace
}  // namespace penalty::testing
