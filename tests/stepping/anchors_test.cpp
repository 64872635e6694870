// Anchors of particles at rigid bodies: what they make of velocities is what a direct solve of all of them makes.
#include <Eigen/QR>

#include "math/random.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

/// Particles without forces and rigid spheres, all of which move anyhow.
struct Scene {
  Body body;
  std::vector<RigidBody> rigid;
  std::vector<Anchor> anchors = {};

  Scene(std::vector<Real> masses, int num_rigid, int seed)
      : body(make_free_particles(Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(masses.size())), masses)) {
    Random random(seed);
    for (int i = 0; i < body.particles().size(); ++i) {
      body.set_position(i, random.vector(1));
      body.set_velocity(i, random.vector(2));
    }
    for (int k = 0; k < num_rigid; ++k) {
      rigid.push_back(make_sphere(1, 0.5, random.vector(1)));
      rigid.back().velocity = random.vector(1);
      rigid.back().angular_velocity = random.vector(3);
    }
  }

  void anchor(int particle, int to) {
    const RigidBody& at = rigid[static_cast<std::size_t>(to)];
    anchors.push_back({.a = Side::of_particles(0, WeightedPoint::at_particle(particle)),
                       .b = Side::of_rigid(to, at.rotation.transpose() * (body.position(particle) - at.position))});
  }

  // Velocities of particles, then of rigid bodies, linear and angular.
  Eigen::VectorXd velocities() const {
    const auto n = static_cast<Eigen::Index>(body.particles().size());
    Eigen::VectorXd all(3 * n + 6 * static_cast<Eigen::Index>(rigid.size()));
    for (int i = 0; i < n; ++i) all.segment<3>(3 * i) = body.velocity(i);
    for (std::size_t k = 0; k < rigid.size(); ++k)
      all.segment<6>(3 * n + 6 * static_cast<Eigen::Index>(k)) << rigid[k].velocity, rigid[k].angular_velocity;
    return all;
  }

  // v + W Jᵀ l, with which J v = 0: an impact without rebound.
  Eigen::VectorXd after_impact() const {
    const Eigen::VectorXd before = velocities();
    const auto n = 3 * static_cast<Eigen::Index>(body.particles().size());
    Eigen::MatrixXd inverse_mass = Eigen::MatrixXd::Zero(before.size(), before.size());
    for (Eigen::Index i = 0; i < n; ++i)
      inverse_mass(i, i) = body.particles().inverse_masses[static_cast<std::size_t>(i / 3)];
    for (std::size_t k = 0; k < rigid.size(); ++k) {
      const Eigen::Index at = n + 6 * static_cast<Eigen::Index>(k);
      inverse_mass.block<3, 3>(at, at) = rigid[k].inverse_mass.asDiagonal();
      inverse_mass.block<3, 3>(at + 3, at + 3) = rigid[k].inverse_inertia;
    }
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(anchors.size()), before.size());
    for (std::size_t r = 0; r < anchors.size(); ++r) {
      const int i = anchors[r].a.point.particles[0], k = anchors[r].b.rigid;
      const Vector3 arm = body.position(i) - rigid[static_cast<std::size_t>(k)].position;
      auto row = rows.middleRows<3>(3 * static_cast<Eigen::Index>(r));
      row.middleCols<3>(3 * i) = Matrix3::Identity();
      row.middleCols<3>(n + 6 * k) = -Matrix3::Identity();
      for (int axis = 0; axis < 3; ++axis) row.col(n + 6 * k + 3 + axis) = -Vector3::Unit(axis).cross(arm);
    }
    const Eigen::MatrixXd dual = rows * inverse_mass * rows.transpose();
    const Eigen::VectorXd impulses = dual.completeOrthogonalDecomposition().solve(-rows * before);
    return before + inverse_mass * rows.transpose() * impulses;
  }

  void expect_impact(Real tolerance) {
    const Eigen::VectorXd before = velocities(), expected = after_impact();
    ASSERT_GT((expected - before).norm(), 0.1);
    Island island{.bodies = {&body.body}, .rigid_bodies = rigid, .anchors = anchors};
    advance(island, 1e-9);
    rigid = island.rigid_bodies;
    EXPECT_LT((velocities() - expected).norm(), tolerance);
  }
};

std::vector<Real> masses_of_all_sizes() {
  std::vector<Real> masses(40);
  for (std::size_t i = 0; i < masses.size(); ++i) masses[i] = std::pow(10, -5 + 7 * static_cast<Real>(i) / 39);
  return masses;
}

TEST(Anchors, OfOneRigidBodyAreMetAtOnce) {
  Scene scene(masses_of_all_sizes(), 1, 3);
  for (int i = 0; i < 40; ++i) scene.anchor(i, 0);
  scene.expect_impact(1e-6);
}

TEST(Anchors, OfAParticleAtTwoRigidBodiesJointThem) {
  for (const Real mass : {1e-6, 1e-3, 1.0, 1e3}) {
    SCOPED_TRACE(mass);
    Scene scene({mass, 0.1, 0.2}, 3, 4);
    for (const int rigid : {0, 1}) scene.anchor(0, rigid);
    scene.anchor(1, 1);
    scene.anchor(2, 2);
    scene.expect_impact(1e-6);
  }
}

TEST(Anchors, OfPinnedParticlesHoldARigidBody) {
  for (const int count : {1, 2, 3, 12}) {
    SCOPED_TRACE(count);
    Scene scene(std::vector<Real>(12, 1), 1, 5);
    for (int i = 0; i < count; ++i) {
      scene.body.particles().inverse_masses[static_cast<std::size_t>(i)] = 0;
      scene.body.set_velocity(i, {1, 2, 3});
      scene.anchor(i, 0);
    }
    scene.expect_impact(1e-6);
  }
}

TEST(Anchors, ThatAreGivenTwiceHoldOnce) {
  Scene scene({0.5, 2, 1}, 2, 6);
  for (int i = 0; i < 3; ++i)
    for (int times = 0; times < 2; ++times) scene.anchor(i, 0);
  scene.anchor(2, 1);
  scene.expect_impact(1e-6);
}

TEST(Anchors, OfARigidBodyThatTurnsAboutOneAxisOnly) {
  Scene scene({0.5, 2, 1}, 1, 8);
  scene.rigid[0].inverse_mass.y() = 0;
  scene.rigid[0].inverse_inertia = Vector3(0, 2, 0).asDiagonal();
  for (int i = 0; i < 3; ++i) scene.anchor(i, 0);
  scene.expect_impact(1e-6);
}

TEST(Anchors, OfPointsThatShareParticlesHoldThemAll) {
  Scene scene({0.5, 2, 1}, 1, 9);
  scene.rigid[0].velocity.setZero();
  scene.rigid[0].angular_velocity.setZero();
  for (int i = 0; i < 3; ++i) {
    WeightedPoint point{{i, (i + 1) % 3}, {0.75, 0.25}, 2};
    const Vector3 x = point.of(scene.body.particles().positions);
    scene.anchors.push_back({.a = Side::of_particles(0, point), .b = Side::of_rigid(0, x - scene.rigid[0].position)});
  }
  Island island{.bodies = {&scene.body.body}, .rigid_bodies = scene.rigid, .anchors = scene.anchors};
  const Real before = kinetic_energy(scene.body.particles());
  for (int k = 0; k < 10; ++k) advance(island, 1e-9);
  const RigidBody& rigid = island.rigid_bodies[0];
  EXPECT_LT(kinetic_energy(rigid) + kinetic_energy(scene.body.particles()), before);
  for (const Anchor& anchor : scene.anchors) {
    const Vector3 arm = anchor.a.point.of(scene.body.particles().positions) - rigid.position;
    EXPECT_LT((anchor.a.point.of(scene.body.particles().velocities) - rigid.velocity_at(arm)).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace penalty::testing
