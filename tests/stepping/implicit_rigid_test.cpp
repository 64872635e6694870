// What an implicit step does with rigid bodies that can move. Energies, depths, momenta and forces are the tests' own.
#include "penalty/mesh/builders.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

RigidBody make_cuboid(Real mass, const Vector3& size, const Vector3& position) {
  RigidBody body = make_sphere(mass, 1, position);
  const Vector3 squares = size.cwiseAbs2();
  const Vector3 moments = mass / 12 * (Vector3::Constant(squares.sum()) - squares);
  body.inverse_inertia = moments.cwiseInverse().asDiagonal();
  return body;
}

/// A soft box of 8 kg, from the origin to (1, 1, 1) m, on rigid body 0, the ground, if there is gravity; others follow.
struct BoxAndRigids {
  static constexpr Real soft_mass = 8;  // [kg]
  TetMesh mesh = make_box({1, 1, 1}, {3, 3, 3});
  Body body;
  Island island{.rigid_bodies = std::vector<RigidBody>(1)};
  Real gravity, friction = 0.5;
  std::vector<int> bottom, top;

  BoxAndRigids(Real stiffness, Real gravity) : gravity(gravity) {
    const auto count = static_cast<std::size_t>(mesh.vertices.cols());
    for (int i = 0; i < mesh.vertices.cols(); ++i) {
      if (mesh.vertices(1, i) < 1e-9) bottom.push_back(i);
      if (mesh.vertices(1, i) > 1 - 1e-9) top.push_back(i);
    }
    body = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness),
                     std::vector<Real>(count, static_cast<Real>(count) / soft_mass));
    body.body.gravity = Vector3(0, -gravity, 0);
    body.body.options.integrator = Integrator::implicit_step;
  }

  RigidBody& add(RigidBody rigid) {
    rigid.acceleration = Vector3(0, -gravity, 0);
    return island.rigid_bodies.emplace_back(rigid);
  }

  void touch(int particle, int rigid, const Vector3& anchor, const Vector3& normal, Real radius = 0) {
    Contact& contact = island.contacts.emplace_back();
    contact.a = Side::of_particles(0, WeightedPoint::at_particle(particle));
    contact.b = Side::of_rigid(rigid, anchor);
    contact.normal = normal;
    contact.radius = radius;
    contact.friction = friction;
  }

  // Of the top with the lower side of a cuboid of this height, as large as one likes.
  void touch_slab(int rigid, Real height) {
    const RigidBody& slab = island.rigid_bodies[rigid];
    for (const int i : top) {
      const Vector3 seen = slab.rotation.transpose() * (body.position(i) - slab.position);
      touch(i, rigid, {seen.x(), -height / 2, seen.z()}, -Vector3::UnitY());
    }
  }

  void step() {
    island.bodies = {&body.body};
    for (const int i : bottom)
      if (gravity > 0) touch(i, 0, {body.position(i).x(), 0, body.position(i).z()}, Vector3::UnitY());
    advance(island, frame);
  }

  Vector3 impulse_of(int rigid) const {  // on the soft body, in the last step
    Vector3 sum = Vector3::Zero();
    for (const Contact& contact : island.contacts)
      if (contact.b.rigid == rigid) sum += contact.given.sum();
    return sum;
  }
  Real least_volume() const {  // of a tetrahedron, by that at rest
    Real least = std::numeric_limits<Real>::infinity();
    for (const std::array<int, 4>& t : mesh.tetrahedra) {
      const auto volume = [&t](const auto& x) {
        Matrix3 edges;
        for (int k = 0; k < 3; ++k) edges.col(k) = x(t[k + 1]) - x(t[0]);
        return edges.determinant();
      };
      least = std::min(least, volume([this](int i) { return body.position(i); }) /
                                  volume([this](int i) { return Vector3(mesh.vertices.col(i)); }));
    }
    return least;
  }
  Real energy() const {
    Real sum = body.field->energy(body.particles().positions) + kinetic_energy(body.particles());
    for (int i = 0; i < body.particles().size(); ++i)
      sum += gravity * body.position(i).y() / body.particles().inverse_masses[i];
    for (const RigidBody& rigid : island.rigid_bodies)
      if (rigid.is_dynamic()) sum += kinetic_energy(rigid) + gravity * rigid.position.y() / rigid.inverse_mass.x();
    return sum;
  }
  Real kinetic() const {
    Real sum = kinetic_energy(body.particles());
    for (const RigidBody& rigid : island.rigid_bodies) sum += kinetic_energy(rigid);
    return sum;
  }
};

TEST(ImplicitRigidContact, ASlabOfAnyMassFallsOnASoftBoxAndRestsOnIt) {
  constexpr Real height = 0.2, fall = 1;
  for (const Real mass : {0.01, 8.0, 800.0, 8000.0})
    for (const Real stiffness : {1e3, 1e5, 1e7}) {
      if (mass * g * fall > stiffness / 10) continue;  // would crush it
      SCOPED_TRACE("mass " + std::to_string(mass) + ", K " + std::to_string(stiffness));
      BoxAndRigids scene(stiffness, g);
      scene.add(make_cuboid(mass, {2, height, 2}, {0.55, 1 + fall + height / 2, 0.5}));
      const Real start = scene.energy(), all = mass * g * fall;
      Real deepest = 0;
      for (int step = 0; step < 300; ++step) {
        scene.island.contacts.clear();
        scene.touch_slab(1, height);
        scene.step();
        ASSERT_TRUE(scene.body.body.report.finite);
        ASSERT_EQ(scene.body.body.report.integrator, Integrator::implicit_step);
        EXPECT_LT(scene.energy(), start + 1e-6 * all) << "step " << step;
        EXPECT_GT(scene.least_volume(), 0) << "step " << step;
        const RigidBody& slab = scene.island.rigid_bodies[1];
        for (const int i : scene.top) {
          const Vector3 seen = slab.rotation.transpose() * (scene.body.position(i) - slab.position);
          deepest = std::max(deepest, seen.y() + height / 2);
        }
        for (const int i : scene.bottom) deepest = std::max(deepest, -scene.body.position(i).y());
      }
      EXPECT_LT(deepest, 5e-3);
      EXPECT_LT(scene.kinetic(), 1e-4 * all);
      const Real weight = frame * mass * g, own = frame * BoxAndRigids::soft_mass * g;
      EXPECT_NEAR(-scene.impulse_of(1).y(), weight, 1e-3 * (weight + own));
      EXPECT_NEAR(scene.impulse_of(0).y(), weight + own, 1e-3 * (weight + own));
    }
}

TEST(ImplicitRigidContact, AHitInFreeSpaceKeepsBothMomentaAndGainsNothing) {
  constexpr Real radius = 0.4;
  for (const Real mass : {0.08, 8.0, 8000.0})
    for (const Real friction : {0.0, 1.0}) {
      SCOPED_TRACE("mass " + std::to_string(mass) + ", friction " + std::to_string(friction));
      BoxAndRigids scene(1e4, 0);
      scene.friction = friction;
      RigidBody& ball = scene.add(make_sphere(mass, radius, {0.8, 1 + radius + 0.1, 0.7}));
      ball.velocity = Vector3(1, -6, 0.5);
      ball.angular_velocity = Vector3(4, -3, 9);
      const auto all = [&] { return momentum({&scene.body}, scene.island.rigid_bodies); };
      const Momentum before = all();
      Real last = scene.energy();
      bool has_touched = false;
      WorstError linear, angular, gain;
      for (unsigned step = 0; step < 60; ++step) {
        scene.island.contacts.clear();
        for (const int i : scene.top) scene.touch(i, 1, Vector3::Zero(), Vector3::UnitY(), radius);
        scene.step();
        ASSERT_EQ(scene.body.body.report.integrator, Integrator::implicit_step);
        has_touched = has_touched || !scene.impulse_of(1).isZero(0);
        linear.see((all().linear - before.linear).norm() / before.linear.norm(), step);
        angular.see((all().angular - before.angular).norm() / before.angular.norm(), step);
        gain.see((scene.energy() - last) / last, step);
        last = scene.energy();
      }
      EXPECT_TRUE(has_touched);
      linear.expect_below(1e-12, "momentum");
      angular.expect_below(1e-12, "angular momentum");
      gain.expect_below(1e-12, "energy");
    }
}

TEST(ImplicitRigidContact, AParticleStopsACubeThatTurnsAsInClosedForm) {
  // Without friction, at a point of its lower side, off its centre.
  constexpr Real mass = 2, size = 0.5, speed = 3;
  Body particle = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {0.7});
  particle.body.options.integrator = Integrator::implicit_step;
  const Vector3 arm(0.1, -size / 2, -0.2);
  std::vector<RigidBody> cubes{make_cuboid(mass, Vector3::Constant(size), -arm)};
  cubes[0].velocity = Vector3(0, -speed, 0);
  particle.touch(WeightedPoint::at_particle(0), 0, arm, -Vector3::UnitY());
  const Vector3 turned = arm.cross(Vector3::UnitY()) * (6 / (mass * size * size));
  const Real impulse = speed / (1 / 0.7 + 1 / mass + turned.cross(arm).y());
  advance(particle, frame, cubes);
  ASSERT_EQ(particle.body.report.integrator, Integrator::implicit_step);
  EXPECT_NEAR(particle.velocity(0).y(), -impulse / 0.7, 1e-3 * speed);
  EXPECT_NEAR(cubes[0].velocity.y(), -speed + impulse / mass, 1e-3 * speed);
  EXPECT_LT((cubes[0].angular_velocity - impulse * turned).norm(), 1e-3 * (impulse * turned).norm());
}

TEST(ImplicitRigidContact, ACubeStandsOnASlabOnASoftBox) {
  constexpr Real height = 0.2, size = 0.4;
  BoxAndRigids scene(1e5, g);
  scene.add(make_cuboid(20, {1.2, height, 1.2}, {0.5, 1 + height / 2, 0.5}));
  scene.add(make_cuboid(50, Vector3::Constant(size), {0.6, 1 + height + size / 2 + 0.01, 0.55}));
  for (const Real x : {-size / 2, size / 2})
    for (const Real z : {-size / 2, size / 2})
      scene.island.rigid_contacts.push_back({.a = 2,
                                             .b = 1,
                                             .anchor_a = {x, -size / 2, z},
                                             .anchor_b = {x + 0.1, height / 2, z + 0.05},
                                             .friction = 0.5});
  for (int step = 0; step < 240; ++step) {
    scene.island.contacts.clear();
    scene.touch_slab(1, height);
    scene.step();
    ASSERT_EQ(scene.body.body.report.integrator, Integrator::implicit_step);
  }
  EXPECT_LT(scene.kinetic(), 1e-6);
  const RigidBody &slab = scene.island.rigid_bodies[1], &cube = scene.island.rigid_bodies[2];
  const Vector3 apart = slab.rotation.transpose() * (cube.position - slab.position);
  EXPECT_NEAR(apart.y(), (height + size) / 2, 1e-4);
  EXPECT_LT((apart - Vector3(0.1, apart.y(), 0.05)).norm(), 1e-3);
  EXPECT_NEAR(-scene.impulse_of(1).y(), frame * 70 * g, 1e-3 * frame * 70 * g);
  Real carried = 0;
  for (const RigidContact& contact : scene.island.rigid_contacts) carried += contact.force.y();
  EXPECT_NEAR(carried, 50 * g, 1e-3 * 50 * g);
}

TEST(ImplicitRigidContact, LeavesWhatCannotMoveFreelyOrReboundsToTheSubsteps) {
  const auto integrator = [](const auto& change) {
    BoxAndRigids scene(1e4, g);
    scene.add(make_cuboid(5, {2, 0.2, 2}, {0.5, 1.1, 0.5}));
    scene.add(make_cuboid(5, {0.2, 0.2, 0.2}, {0.5, 1.3, 0.5}));
    scene.island.rigid_contacts.push_back({.a = 2, .b = 1, .anchor_a = {0, -0.1, 0}, .anchor_b = {0, 0.1, 0}});
    change(scene.island);
    scene.touch_slab(1, 0.2);
    scene.step();
    return scene.body.body.report.integrator;
  };
  EXPECT_EQ(integrator([](Island&) {}), Integrator::implicit_step);
  EXPECT_EQ(integrator([](Island& island) { island.rigid_bodies[1].inverse_mass.x() = 0; }), Integrator::explicit_step);
  EXPECT_EQ(integrator([](Island& island) { island.rigid_bodies[1].inverse_inertia.col(2).setZero(); }),
            Integrator::explicit_step);
  const auto falling = [&](Real speed) {
    return integrator([speed](Island& island) {
      island.rigid_contacts[0].restitution = 0.5;
      island.rigid_bodies[2].velocity = Vector3(0, -speed, 0);
    });
  };
  EXPECT_EQ(falling(0.1), Integrator::implicit_step) << "too slow to rebound";
  EXPECT_EQ(falling(1), Integrator::explicit_step);
}

}  // namespace
}  // namespace penalty::testing
