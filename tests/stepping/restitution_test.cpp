// What restitution gives back, in closed form: particles without forces between them have no rebound of their own.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// Particles that fall on what is under them.
struct Falling {
  Body body;
  Island island;

  explicit Falling(const Eigen::Matrix3Xd& positions, std::vector<Real> masses, Real restitution)
      : body(make_free_particles(positions, std::move(masses))) {
    island.bodies = {&body.body};
    island.rigid_bodies.resize(1);
    island.impacts = {{.body = 0, .other_rigid = 0, .restitution = restitution}};
    for (int i = 0; i < body.particles().size(); ++i)
      island.contacts.push_back(
          {.a = Side::of_particles(0, WeightedPoint::at_particle(i)), .b = Side::of_rigid(0, {0, 0, 0})});
  }
  RigidBody& other() { return island.rigid_bodies[0]; }
  void set_velocity(const Vector3& v) {
    for (int i = 0; i < body.particles().size(); ++i) body.set_velocity(i, v);
  }
  void step(int count = 1) {
    for (int k = 0; k < count; ++k) advance(island, frame);
  }
};

TEST(Restitution, OfAParticleIsNewtonsLaw) {
  for (const Real e : {0.0, 0.25, 0.5, 0.9, 1.0})
    for (const Real height : {0.0, 0.07, 0.4}) {
      SCOPED_TRACE(::testing::Message() << e << " from " << height << " m");
      Falling f(Vector3(0, height, 0), {3}, e);
      f.set_velocity({0.5, -4, 0});
      f.step(30);
      EXPECT_NEAR(f.body.velocity(0).y(), 4 * e, 1e-12);
      EXPECT_EQ(f.body.velocity(0).x(), 0.5);
      EXPECT_GE(f.body.position(0).y(), 0);
    }
}

TEST(Restitution, IsNoneBelowTheThreshold) {
  Falling f(Vector3(0, 0.01, 0), {3}, 1);
  f.set_velocity({0, -0.19, 0});
  f.step(30);
  EXPECT_EQ(f.body.velocity(0).y(), 0);
}

TEST(Restitution, OfAMovingObstacleIsRelativeToIt) {
  Falling f(Vector3(0, 0.1, 0), {3}, 0.5);
  f.set_velocity({0, -1, 0});
  f.other().velocity = {0, 2, 0};
  f.step(10);
  EXPECT_NEAR(f.body.velocity(0).y(), 2 + 0.5 * 3, 1e-12);
}

// A rod of two particles that hits with one end turns, and the other end goes on.
TEST(Restitution, OfABodyThatHitsOffItsCentreIsThatOfARigidOne) {
  Eigen::Matrix3Xd ends(3, 2);
  ends << 0, 3, 0, 0, 0, 0;
  Falling f(ends, {1, 1}, 0.8);
  f.island.contacts.resize(1);
  f.set_velocity({0, -2, 0});
  f.step(2);
  EXPECT_NEAR(f.body.velocity(0).y(), 0.8 * 2, 0.01);
  EXPECT_NEAR(f.body.velocity(1).y(), -2, 0.01);
  EXPECT_NEAR(kinetic_energy(f.body.particles()), 2 + 0.64 * 2, 0.03);
}

TEST(Restitution, OfABodyThatHitsAFreeOneKeepsBothMomenta) {
  for (const Real e : {0.0, 0.5, 1.0}) {
    SCOPED_TRACE(e);
    Falling f(Vector3(0.2, 0.3, 0.1), {2}, e);
    f.set_velocity({0, -3, 0});
    f.other() = make_sphere(5, 0.4, {0, 0, 0});
    const Momentum before = momentum({&f.body}, f.island.rigid_bodies);
    const Real energy = kinetic_energy(f.body.particles());
    f.step(20);
    const Momentum after = momentum({&f.body}, f.island.rigid_bodies);
    EXPECT_LT((after.linear - before.linear).norm(), 1e-13);
    EXPECT_LT((after.angular - before.angular).norm(), 1e-12);
    EXPECT_LE(kinetic_energy(f.body.particles()) + kinetic_energy(f.other()), energy * (1 + 1e-12));
    const Real leaving = f.body.velocity(0).y() - f.other().velocity_at({0.2, 0, 0.1}).y();
    EXPECT_NEAR(leaving, 3 * e, 0.02) << "the sphere has turned a little";
  }
}

TEST(Restitution, ClosesTheBooksOfEnergyAndOfImpulses) {
  Falling f(Vector3(0, 0.1, 0), {3}, 0.7);
  f.set_velocity({0, -4, 0});
  Vector3 impulse = Vector3::Zero();
  for (int k = 0; k < 10; ++k) {
    f.step();
    for (const ContactRecord& record : f.island.records) impulse += record.impulse;
  }
  EXPECT_NEAR(impulse.y(), 3 * 4 * 1.7, 1e-12);
  const Real energy = 3 * 16.0 / 2;
  EXPECT_NEAR(kinetic_energy(f.body.particles()), 0.49 * energy, 1e-11);
  const EnergyFlows& flows = f.body.body.flows;
  EXPECT_NEAR(flows.received() - flows.lost(), -0.51 * energy, 1e-11);
  EXPECT_NEAR(flows.contact_loss, 0.51 * energy, 1e-11);
}

// Pressed from both sides it can leave to neither.
TEST(Restitution, OfWhatIsHeldTightIsNone) {
  Falling f(Vector3(0, 0.05, 0), {1}, 1);
  f.island.contacts.push_back({.a = Side::of_particles(0, WeightedPoint::at_particle(0)),
                               .b = Side::of_rigid(0, {0, 0.05, 0}),
                               .normal = {0, -1, 0}});
  f.set_velocity({0, -3, 0});
  f.step(30);
  EXPECT_LE(kinetic_energy(f.body.particles()), 4.5);
  EXPECT_GE(f.body.position(0).y(), -1e-12);
  EXPECT_LE(f.body.position(0).y(), 0.05 + 1e-12);
}

}  // namespace
}  // namespace penalty::testing
