#include "penalty/stepping/rigid_body.h"

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

TEST(RigidBody, DriftIsUniformTranslationAndRotation) {
  Random random(1);
  RigidBody body;
  body.position = Vector3(1, 2, 3);
  body.velocity = Vector3(0.5, -1, 2);
  body.angular_velocity = Vector3(0.3, -0.4, 1.2);  // 1.3 rad/s
  body.rotation = random.rotation();
  const Matrix3 axes = body.rotation;
  const Vector3 in_body(1, 2, 5);
  body.inverse_inertia = axes * in_body.asDiagonal() * axes.transpose();
  for (int step = 0; step < 1000; ++step) body.drift(0.002);
  EXPECT_LT((body.position - Vector3(2, 0, 7)).norm(), 1e-12);
  const Matrix3 turned = Eigen::AngleAxis<Real>(2 * 1.3, body.angular_velocity / 1.3).toRotationMatrix() * axes;
  EXPECT_LT((body.rotation - turned).norm(), 1e-12);
  EXPECT_LT((body.rotation * body.rotation.transpose() - Matrix3::Identity()).norm(), 1e-12);
  EXPECT_LT((body.inverse_inertia - turned * in_body.asDiagonal() * turned.transpose()).norm(), 1e-11);
  EXPECT_LT((body.turn - 2 * body.angular_velocity).norm(), 1e-12);
}

TEST(RigidBody, VelocityOfAPointAddsTheRotation) {
  RigidBody body;
  body.velocity = Vector3(1, 0, 0);
  body.angular_velocity = Vector3(0, 0, 2);
  EXPECT_EQ(body.velocity_at({0, 3, 0}), Vector3(-5, 0, 0));
}

TEST(RigidBody, WithoutInverseMassAndInertiaIsAnObstacle) {
  RigidBody body;
  EXPECT_FALSE(body.is_dynamic());
  body.inverse_mass.y() = 1;  // free along one axis
  EXPECT_TRUE(body.is_dynamic());
  body = {};
  body.inverse_inertia(2, 2) = 1;  // a hinge
  EXPECT_TRUE(body.is_dynamic());
}

TEST(RigidBody, FallsWithItsAcceleration) {
  Body particle = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {1});
  particle.body.options.substeps = 5;
  RigidBody body = make_sphere(2, 1, {0, 10, 0});
  body.acceleration = Vector3(0, -10, 0);
  body.velocity = Vector3(3, 0, 0);
  for (int step = 0; step < 10; ++step) advance(particle, 0.1, std::span(&body, 1));
  EXPECT_LT((body.position - Vector3(3, 5, 0)).norm(), 1e-12);
  EXPECT_LT((body.velocity - Vector3(3, -10, 0)).norm(), 1e-12);
  EXPECT_EQ(particle.body.report.retries, 0);
}

TEST(Particles, MomentaAndEnergyCountOnlyWhatHasMass) {
  Particles p;
  p.positions = PackedVectors::Zero(4, 2);
  p.velocities = PackedVectors::Zero(4, 2);
  p.positions.col(0) << 1, 0, 0, 0;
  p.velocities.col(0) << 0, 2, 0, 0;
  p.velocities.col(1) << 9, 9, 9, 0;
  p.inverse_masses = {0.25, 0};
  EXPECT_DOUBLE_EQ(kinetic_energy(p), 8);
  EXPECT_EQ(linear_momentum(p), Vector3(0, 8, 0));
  EXPECT_EQ(angular_momentum(p), Vector3(0, 0, 8));
  EXPECT_EQ(angular_momentum(p, {1, 0, 0}), Vector3(0, 0, 0));
}

}  // namespace
}  // namespace penalty::testing
