// What an implicit step does with contacts. Energies, depths and forces are the tests' own.
#include <numbers>

#include "penalty/mesh/builders.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

constexpr Real box_mass = 8;  // [kg]

/// A box of cells on or above the plane through the origin, along +y, with gravity turned by `slope` towards +x.
struct BoxOnPlane {
  Body body;
  Island island{.rigid_bodies = std::vector<RigidBody>(1)};
  RigidBody& plane() { return island.rigid_bodies.front(); }
  Vector3 gravity;
  Real friction = 0.5;

  BoxOnPlane(const Vector3& size, const std::array<int, 3>& cells, Real stiffness, Real height, Real slope = 0)
      : gravity(g * Vector3(std::sin(slope), -std::cos(slope), 0)) {
    const TetMesh mesh = make_box(size, cells);
    const auto count = static_cast<std::size_t>(mesh.vertices.cols());
    body = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness),
                     std::vector<Real>(count, static_cast<Real>(count) / box_mass));
    body.particles().positions.row(1).array() += height - body.particles().positions.row(1).minCoeff();
    body.body.positions_changed();
    body.body.gravity = gravity;
    body.body.options.integrator = Integrator::implicit_step;
  }

  void touch(const Vector3& x) {
    Contact& contact = island.contacts.emplace_back();
    contact.a = Side::of_particles(0, WeightedPoint::at_particle(static_cast<int>(island.contacts.size()) - 1));
    contact.b = Side::of_rigid(0, {x.x(), 0, x.z()});
    contact.friction = friction;
  }

  void step(Real duration) {
    island.bodies = {&body.body};
    island.contacts.clear();
    for (int i = 0; i < body.particles().size(); ++i) touch(body.position(i));
    advance(island, duration);
  }

  Real lowest() const { return body.particles().positions.row(1).minCoeff(); }
  Real fastest() const { return body.particles().velocities.colwise().norm().maxCoeff(); }
  Vector3 impulse() const {  // of all contacts in the last step
    Vector3 sum = Vector3::Zero();
    for (const Contact& contact : island.contacts) sum += contact.given.sum();
    return sum;
  }
  Real energy() const {
    Real potential = 0;
    for (int i = 0; i < body.particles().size(); ++i)
      potential -= gravity.dot(body.position(i)) / body.particles().inverse_masses[i];
    return body.field->energy(body.particles().positions) + kinetic_energy(body.particles()) + potential;
  }
};

TEST(ImplicitContact, AParticleFallsStopsSlidesAndSticksAsInClosedForm) {
  for (const Real coefficient : {0.0, 0.2, 0.8}) {
    SCOPED_TRACE("friction " + std::to_string(coefficient));
    const Real angle = std::numbers::pi / 6;
    const Vector3 normal(std::sin(angle), std::cos(angle), 0), downhill(std::cos(angle), -std::sin(angle), 0);
    Body particle = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {3});
    particle.body.gravity = Vector3(0, -g, 0);
    particle.body.options.integrator = Integrator::implicit_step;
    particle.touch(WeightedPoint::at_particle(0), 0, {0, 0, 0}, normal, coefficient);
    std::vector<RigidBody> plane(1);
    for (int step = 0; step < 60; ++step) {
      advance(particle, frame, plane);
      ASSERT_EQ(particle.body.report.integrator, Integrator::implicit_step);
    }
    EXPECT_LT(std::abs(normal.dot(particle.position(0))), 1e-6);
    const Real speed = g * std::max<Real>(std::sin(angle) - coefficient * std::cos(angle), 0);
    EXPECT_NEAR(downhill.dot(particle.velocity(0)), speed, 1e-3 * g) << "after a second";
  }
}

TEST(ImplicitContact, WhateverTheStiffnessABodyIsDroppedOnAPlaneWithoutGainAndComesToRest) {
  for (const Real rate : {30.0, 60.0, 240.0})
    for (const Real damping_time : {0.0, 0.01})
      for (Real stiffness = 1e2; stiffness < 1e9; stiffness *= 100) {
        SCOPED_TRACE("rate " + std::to_string(rate) + ", damping " + std::to_string(damping_time) + ", K " +
                     std::to_string(stiffness));
        BoxOnPlane box({1, 1, 1}, {3, 3, 3}, stiffness, 1);
        box.body.body.options.damping_time = damping_time;
        const Real start = box.energy(), fall = box_mass * g;
        Real largest = start, deepest = 0;
        for (int step = 0; step < static_cast<int>(4 * rate); ++step) {
          box.step(1 / rate);
          ASSERT_TRUE(box.body.body.report.finite);
          ASSERT_EQ(box.body.body.report.integrator, Integrator::implicit_step);
          largest = std::max(largest, box.energy());
          deepest = std::max(deepest, -box.lowest());
        }
        EXPECT_LE(largest, start + 1e-6 * fall);
        EXPECT_LT(deepest, 1e-3);
        EXPECT_LT(kinetic_energy(box.body.particles()), 1e-4 * fall);
        EXPECT_NEAR(box.impulse().y(), box_mass * g / rate, 1e-3 * box_mass * g / rate);
      }
}

TEST(ImplicitContact, OnASlopeABodyRestsAndIsCarriedByItsWeight) {
  // Drake's example: 15 degrees, five seconds, below 2e-5 m/s.
  BoxOnPlane box({1, 0.5, 1}, {6, 3, 6}, 1e3, 0, std::numbers::pi / 12);
  for (int step = 0; step < 300; ++step) box.step(frame);
  EXPECT_LT(box.fastest(), 2e-5);
  EXPECT_LT((box.impulse() + frame * box_mass * box.gravity).norm(), 1e-5 * frame * box_mass * g);
}

TEST(ImplicitContact, WhatContactsGiveIsWhatTheMomentaOfTheBodyChangeBy) {
  BoxOnPlane box({1, 1, 1}, {3, 3, 3}, 1e4, 0.02);
  for (int i = 0; i < box.body.particles().size(); ++i)
    box.body.set_velocity(i, Vector3(2, -3, 0.5) + Vector3(1, -2, 3).cross(box.body.position(i)));
  WorstError error;
  for (unsigned step = 0; step < 30; ++step) {
    const Momentum before = momentum({&box.body});
    box.step(frame);
    const Vector3 change = momentum({&box.body}).linear - before.linear;
    error.see((change - frame * box_mass * box.gravity - box.impulse()).norm(), step);
  }
  error.expect_below(1e-10, "momentum");
}

TEST(ImplicitContact, FollowsAPlaneThatMoves) {
  // A conveyor and a lift in one: the box ends at its velocity, a step's lag apart at its height.
  BoxOnPlane box({1, 1, 1}, {3, 3, 3}, 1e4, 0);
  box.plane().velocity = Vector3(0.4, 0.3, 0);
  for (int step = 0; step < 120; ++step) box.step(frame);
  for (int i = 0; i < box.body.particles().size(); ++i)
    EXPECT_LT((box.body.velocity(i) - box.plane().velocity).norm(), 1e-3) << "particle " << i;
  EXPECT_NEAR(box.lowest(), 0.6, 1e-4);
}

TEST(ImplicitContact, ABoxThatTumblesNeedsNoSubstepsAndGainsNothing) {
  BoxOnPlane box({1, 0.6, 0.8}, {4, 3, 3}, 1e5, 0.3);
  for (int i = 0; i < box.body.particles().size(); ++i)
    box.body.set_velocity(i, Vector3(3, 0, 1) + Vector3(2, 1, -6).cross(box.body.position(i)));
  Real last = box.energy();
  const Real start = last;
  for (int step = 0; step < 180; ++step) {
    box.step(frame);
    EXPECT_EQ(box.body.body.report.substeps, 1) << "step " << step;
    EXPECT_LT(box.energy(), last + 1e-5 * start) << "step " << step;
    last = box.energy();
  }
  EXPECT_GT(box.lowest(), -1e-4);
}

TEST(ImplicitContact, TakesDepthBackGently) {
  for (const Real depth : {0.5e-3, 5e-3, 50e-3}) {
    SCOPED_TRACE("depth " + std::to_string(depth));
    BoxOnPlane box({1, 1, 1}, {3, 3, 3}, 1e4, -depth);
    Real fastest = 0;
    for (int step = 0; step < 120; ++step) {
      box.step(frame);
      fastest = std::max(fastest, box.fastest());
      ASSERT_EQ(box.body.body.report.substeps, 1);
    }
    EXPECT_LT(fastest, 0.75);
    EXPECT_GT(box.lowest(), -1e-4);
    EXPECT_LT(kinetic_energy(box.body.particles()), 1e-6);
  }
}

}  // namespace
}  // namespace penalty::testing
