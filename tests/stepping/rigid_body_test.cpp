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

// Links of one articulated body that can move `ways` ways, in places of an array with another body between them.
struct ArticulatedBody {
  Articulation articulation;
  std::vector<RigidBody> bodies;

  ArticulatedBody(int num_links, int ways, Random& random) : bodies(2 * static_cast<std::size_t>(num_links)) {
    const Eigen::MatrixXd jacobian =
        Eigen::MatrixXd::NullaryExpr(6 * num_links, ways, [&] { return random.uniform(-1, 1); });
    articulation.mobility = jacobian * jacobian.transpose();
    articulation.inertia = articulation.mobility.completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::VectorXd motion = jacobian * Eigen::VectorXd::NullaryExpr(ways, [&] { return random.uniform(-1, 1); });
    const Eigen::VectorXd acceleration =
        jacobian * Eigen::VectorXd::NullaryExpr(ways, [&] { return random.uniform(-1, 1); });
    for (int k = 0; k < num_links; ++k) {
      articulation.places.push_back(2 * k + 1);
      RigidBody& link = this->link(k);
      link.articulation = &articulation;
      link.link = k;
      link.velocity = motion.segment<3>(6 * k);
      link.angular_velocity = motion.segment<3>(6 * k + 3);
      link.acceleration = acceleration.segment<3>(6 * k);
      link.angular_acceleration = acceleration.segment<3>(6 * k + 3);
    }
  }
  RigidBody& link(int k) { return bodies[static_cast<std::size_t>(articulation.places[static_cast<std::size_t>(k)])]; }
  Real energy() const {
    Real sum = 0;
    for (const RigidBody& body : bodies) sum += kinetic_energy(body);
    return sum;
  }
};

TEST(Articulation, TakesPushesByTheMobilityOfItsLinksAndTheirWorkAsEnergy) {
  Random random(7);
  for (int run = 0; run < 20; ++run) {
    ArticulatedBody body(3, 5, random);
    RigidBody &pushed = body.link(run % 3), &other = body.link((run + 1) % 3);
    EXPECT_TRUE(pushed.is_dynamic());
    EXPECT_FALSE(pushed.is_free());
    const Vector3 arm = random.vector(1), impulse = random.vector(2), before = pushed.velocity_at(arm);
    const Vector3 of_other = other.velocity;
    const Matrix3 mobility = pushed.mobility_at(arm);
    const Real energy = body.energy(), work = pushed.push(impulse, arm);
    EXPECT_LT((pushed.velocity_at(arm) - before - mobility * impulse).norm(), 1e-12);
    EXPECT_LE(mobility.norm(), std::sqrt(3.0) * pushed.mobility_bound(arm.norm()));
    EXPECT_NEAR(body.energy() - energy, work, 1e-9);
    EXPECT_GT((other.velocity - of_other).norm(), 0);
    EXPECT_TRUE(body.bodies[2].velocity.isZero(0)) << "of another body";
  }
}

TEST(Articulation, IsAcceleratedByForcesWhoseWorkIsItsEnergy) {
  Random random(9);
  ArticulatedBody body(2, 4, random);
  const std::vector<RigidBody> start = body.bodies;
  const Real energy = body.energy();
  for (int step = 0; step < 10; ++step)
    for (RigidBody& link : body.bodies) {
      link.kick(0.005);
      link.drift(0.01);
      link.kick(0.005);
    }
  Real work = 0;
  for (std::size_t k = 0; k < start.size(); ++k) work += work_of_accelerations(body.bodies[k], start[k]);
  EXPECT_GT(std::abs(work), 1e-3);
  EXPECT_NEAR(body.energy() - energy, work, 1e-9);
}

TEST(Articulation, OfAFreeBodyMovesLikeIt) {
  Random random(8);
  RigidBody body = make_sphere(2, 0.3, {0, 1, 0}), link = body;
  Articulation alone{{0}, Eigen::MatrixXd::Zero(6, 6), {}};
  alone.mobility.diagonal() << body.inverse_mass, body.inverse_inertia.diagonal();
  alone.inertia = alone.mobility.inverse();
  link.articulation = &alone;
  link.inverse_mass.setZero();
  link.inverse_inertia.setZero();
  for (RigidBody* one : {&body, &link}) one->acceleration = {0, -10, 3};
  const RigidBody start = body;
  for (int k = 0; k < 20; ++k) {
    const Vector3 impulse = random.vector(1), arm = random.vector(0.3);
    for (RigidBody* one : {&body, &link}) {
      one->kick(0.01);
      one->push(impulse, arm);
      one->drift(0.01);
    }
  }
  EXPECT_LT((body.position - link.position).norm() + (body.rotation - link.rotation).norm(), 1e-13);
  EXPECT_NEAR(kinetic_energy(body), kinetic_energy(link), 1e-10);
  EXPECT_NEAR(work_of_accelerations(body, start), work_of_accelerations(link, start), 1e-10);
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
