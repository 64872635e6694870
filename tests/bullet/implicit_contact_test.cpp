// Stiff bodies in contact, stepped implicitly.
#include <algorithm>
#include <cmath>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class ImplicitContactTest : public WorldTest {};

/// A torus of 1 kg that lies down from a height above the ground.
struct Fall {
  Simulation sim;
  btRigidBody& ground;
  const btSoftBody& body;
  Real start;

  Fall(WorldKind kind, Real stiffness, Real height, Integrator integrator)
      : sim(kind), ground(sim.add_ground()), body(add(stiffness, height, integrator)), start(sim.totals().energy) {}

  const btSoftBody& add(Real stiffness, Real height, Integrator integrator, const Vector3& aside = {0, 0, 0}) {
    sim.set_gravity({0, -g, 0});
    const TetMesh torus = make_torus(0.7, 0.3, 2, 14);
    return sim.add_jelly(torus, {.stiffness = stiffness,
                                 .shift = aside + Vector3(0, height - torus.vertices.row(1).minCoeff(), 0),
                                 .attach = {.step = {.integrator = integrator}}});
  }
  const StepReport& report() { return sim.penalty().report(body); }
  Real weight() {
    Real mass = 0;
    for (const Real inverse_mass : sim.penalty().particles(body).inverse_masses) mass += 1 / inverse_mass;
    return mass * g;
  }
  Real kinetic() { return kinetic_energy(sim.penalty().particles(body)); }
};

constexpr Real jelly_margin = 0.02;  // [m]

TEST_P(ImplicitContactTest, ABodyOfAnyStiffnessFallsAndLiesAtItsMargin) {
  for (const Real stiffness : {1e3, 1e6, 1e10}) {
    SCOPED_TRACE(stiffness);
    Fall fall(GetParam(), stiffness, 0.5, Integrator::implicit_step);
    Real lowest_point = 1, largest = fall.start;
    for (int k = 0; k < 150; ++k) {
      fall.sim.step(frame);
      ASSERT_TRUE(fall.report().finite);
      ASSERT_EQ(fall.report().integrator, Integrator::implicit_step) << "frame " << k;
      lowest_point = std::min(lowest_point, lowest(fall.body));
      largest = std::max(largest, fall.sim.totals().energy);
    }
    EXPECT_GT(lowest_point, jelly_margin - 1e-3);
    EXPECT_NEAR(lowest(fall.body), jelly_margin, 1e-4);
    EXPECT_LE(largest, fall.start * (1 + limit(1e-9, 1e-5)));
    EXPECT_LT(fall.kinetic(), 1e-6 * fall.start);
    Real carried = 0;
    for (const BodyContact& contact : fall.sim.penalty().contacts(fall.body)) carried += contact.impulse.y() / frame;
    EXPECT_NEAR(carried, fall.weight(), 1e-3 * fall.weight());
  }
}

TEST_P(ImplicitContactTest, ByItselfAStiffBodyBouncesInSubstepsAndLiesImplicitly) {
  Fall fall(GetParam(), 3e4, 0.3, Integrator::automatic);
  Real highest = 0;  // after the first contact
  bool has_touched = false;
  for (int k = 0; k < 300; ++k) {
    fall.sim.step(frame);
    has_touched = has_touched || lowest(fall.body) < 1.5 * jelly_margin;
    if (has_touched) highest = std::max(highest, lowest(fall.body));
  }
  EXPECT_GT(highest, 0.05);
  EXPECT_NEAR(lowest(fall.body), jelly_margin, 1e-3);
  EXPECT_EQ(fall.report().integrator, Integrator::implicit_step);
  EXPECT_LT(fall.kinetic(), 1e-6 * fall.start);
}

TEST_P(ImplicitContactTest, AStiffBodyRidesOnATurntable) {
  Simulation sim(GetParam());
  sim.set_gravity({0, -g, 0});
  btRigidBody& platform = sim.add_box({3, 0.1, 3}, 0, {0, -0.1, 0});
  platform.setFriction(1);
  platform.setCollisionFlags(platform.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  platform.forceActivationState(DISABLE_DEACTIVATION);
  const btSoftBody& body = sim.add_jelly(
      make_box({0.4, 0.4, 0.4}, {4, 4, 4}),
      {.stiffness = 1e5, .shift = {0.8, 0.021, -0.2}, .attach = {.step = {.integrator = Integrator::implicit_step}}});
  const Vector3 before = center_of_mass(sim.penalty().particles(body));
  Real angle = 0;
  for (int k = 0; k < 120; ++k) {
    angle += std::min<Real>(1, k * frame) * frame;
    platform.setWorldTransform(
        btTransform(btQuaternion(btVector3(0, 1, 0), static_cast<btScalar>(angle)), btVector3(0, btScalar(-0.1), 0)));
    sim.step(frame);
    ASSERT_EQ(sim.penalty().report(body).integrator, Integrator::implicit_step) << "frame " << k;
  }
  const Vector3 carried = Eigen::AngleAxis<Real>(angle, Vector3::UnitY()) * before;
  EXPECT_LT((center_of_mass(sim.penalty().particles(body)) - carried).norm(), 0.01 * carried.norm());
}

TEST_P(ImplicitContactTest, ASlabOfAnyMassComesToRestOnARingOfAnyStiffness) {
  for (const Real mass : {0.1, 10.0, 1000.0})
    for (const Real stiffness : {1e5, 1e8}) {
      SCOPED_TRACE("mass " + std::to_string(mass) + ", stiffness " + std::to_string(stiffness));
      Fall fall(GetParam(), stiffness, 0.03, Integrator::implicit_step);
      const btRigidBody& slab = fall.sim.add_box({1.5, 0.1, 1.5}, mass, {0.02, 1.2, -0.01});  // its edges far away
      const Real start = fall.sim.totals().energy;
      Real largest = start;
      for (int k = 0; k < 240; ++k) {
        fall.sim.step(frame);
        ASSERT_TRUE(fall.report().finite);
        ASSERT_EQ(fall.report().integrator, Integrator::implicit_step) << "frame " << k;
        largest = std::max(largest, fall.sim.totals().energy);
      }
      EXPECT_LE(largest, start * (1 + limit(1e-9, 1e-5)));
      EXPECT_LT(slab.getLinearVelocity().length(), 5e-3);
      EXPECT_NEAR(slab.getWorldTransform().getOrigin().y(), 0.03 + 0.6 + 0.1, 0.02);
      EXPECT_NEAR(lowest(fall.body), jelly_margin, 1e-3);
      Real carried = 0;
      for (const BodyContact& contact : fall.sim.penalty().contacts(fall.body)) carried += contact.impulse.y() / frame;
      EXPECT_NEAR(carried, fall.weight(), 0.01 * (fall.weight() + mass * g)) << "the ground's less the slab's";
    }
}

TEST_P(ImplicitContactTest, ARingOfAnyStiffnessComesToRestOnAnother) {
  for (const Real stiffness : {1e3, 1e5}) {
    SCOPED_TRACE(stiffness);
    Fall fall(GetParam(), stiffness, 0.3, Integrator::implicit_step);
    const btSoftBody& other = fall.add(stiffness, 1.2, Integrator::implicit_step, {0.3, 0, 0.1});
    const Real start = fall.sim.totals().energy;
    Real largest = start;
    for (int k = 0; k < 180; ++k) {
      fall.sim.step(frame);
      for (const btSoftBody* body : {&fall.body, &other}) {
        ASSERT_TRUE(fall.sim.penalty().report(*body).finite);
        ASSERT_EQ(fall.sim.penalty().report(*body).integrator, Integrator::implicit_step) << "frame " << k;
      }
      largest = std::max(largest, fall.sim.totals().energy);
    }
    EXPECT_LE(largest, start * (1 + limit(1e-9, 1e-5)));
    EXPECT_LT(fall.kinetic() + kinetic_energy(fall.sim.penalty().particles(other)), 1e-6 * start);
    EXPECT_NEAR(lowest(fall.body), jelly_margin, 1e-3);
    EXPECT_GT(lowest(other), 0.54) << "it lies on the other";
    Real carried = 0, on_other = 0;
    for (const BodyContact& contact : fall.sim.penalty().contacts(fall.body))
      if (contact.object == &fall.ground) carried += contact.impulse.y() / frame;
    for (const BodyContact& contact : fall.sim.penalty().contacts(other)) on_other += contact.impulse.y() / frame;
    EXPECT_NEAR(carried, 2 * fall.weight(), 2e-3 * fall.weight());
    EXPECT_NEAR(on_other, fall.weight(), 2e-3 * fall.weight());
  }
}

INSTANTIATE_TEST_SUITE_P(World, ImplicitContactTest, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
