// Links of multibodies: bodies that their joints hold, in the world that has them.
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Real gravity = 10;

btVector3 vector(Real x, Real y, Real z) { return to_bullet(Vector3(x, y, z)); }

/// A multibody of boxes that has no damping and does not sleep, in a world.
class Boxes {
 public:
  Boxes(Simulation& sim, int num_links, Real base_mass, const Vector3& position)
      : sim_(sim), body(num_links, scalar(base_mass), inertia(base_mass), base_mass == 0, false) {
    body.setBaseWorldTransform(btTransform(none, to_bullet(position)));
  }
  Boxes(const Boxes&) = delete;
  Boxes& operator=(const Boxes&) = delete;
  ~Boxes() {
    for (const auto& collider : colliders_) world().removeCollisionObject(collider.get());
    world().removeMultiBody(&body);
  }

  void slide(int link, Real mass, const Vector3& axis) {
    body.setupPrismatic(link, scalar(mass), inertia(mass), -1, none, to_bullet(axis), vector(0, 0, 0), vector(0, 0, 0),
                        true);
  }
  /// About the z axis; `arm`: from the joint to the centre of the link, and `joint` from that of the parent to the joint.
  void hinge(int link, Real mass, const Vector3& joint, const Vector3& arm) {
    body.setupRevolute(link, scalar(mass), inertia(mass), -1, none, vector(0, 0, 1), to_bullet(joint), to_bullet(arm),
                       true);
  }
  btMultiBodyLinkCollider& add_box(int link, const Vector3& half_extents) {
    shapes_.push_back(std::make_unique<btBoxShape>(to_bullet(half_extents)));
    colliders_.push_back(std::make_unique<btMultiBodyLinkCollider>(&body, link));
    btMultiBodyLinkCollider& collider = *colliders_.back();
    collider.setCollisionShape(shapes_.back().get());
    collider.setFriction(1);
    collider.setActivationState(DISABLE_DEACTIVATION);
    if (link < 0)
      body.setBaseCollider(&collider);
    else
      body.getLink(link).m_collider = &collider;
    return collider;
  }
  void enter(Real joint_position = 0) {
    body.finalizeMultiDof();
    body.setLinearDamping(0);
    body.setAngularDamping(0);
    body.setCanSleep(false);
    body.setHasSelfCollision(false);
    if (body.getNumLinks() > 0) body.setJointPos(0, scalar(joint_position));
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> positions;
    body.forwardKinematics(rotations, positions);
    body.updateCollisionObjectWorldTransforms(rotations, positions);
    for (const auto& collider : colliders_) world().addCollisionObject(collider.get());
    world().addMultiBody(&body);
  }

  Real height() const { return Real(colliders_.front()->getWorldTransform().getOrigin().y()); }
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const { return colliders_; }
  btDeformableMultiBodyDynamicsWorld& world() { return sim_.deformable_world(); }

 private:
  static btScalar scalar(Real value) { return static_cast<btScalar>(value); }
  static btVector3 inertia(Real mass) { return vector(mass / 150, mass / 150, mass / 150); }

  inline static const btQuaternion none{0, 0, 0, 1};

  Simulation& sim_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;

 public:
  btMultiBody body;
};

class Links : public WorldTest {};

TEST_P(Links, AFreeBaseKeepsTheMomentumOfWhatItHits) {
  for (const Real mass : {0.1, 1.0, 10.0}) {
    SCOPED_TRACE(mass);
    Simulation of(GetParam());
    btSoftBody& jelly =
        of.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}), {.attach = {.step = {.damping_time = 0.02}}});
    Boxes base(of, 0, mass, {-0.3, 0.25, 0.2});
    base.add_box(-1, {0.1, 0.1, 0.1});
    base.enter();
    base.body.setBaseVel(vector(1, 0, 0));
    for (int k = 0; k < 60; ++k) {
      of.step(frame);
      const Vector3 momentum =
          linear_momentum(of.penalty().particles(jelly)) + mass * to_vector(base.body.getBaseVel());
      ASSERT_LT((momentum - Vector3(mass, 0, 0)).norm(), limit(1e-13, 1e-6) * std::max<Real>(mass, 1));
    }
    EXPECT_GT(linear_momentum(of.penalty().particles(jelly)).x(), 0.4 * mass / (1 + mass));
    EXPECT_LT(
        kinetic_energy(of.penalty().particles(jelly)) + mass / 2 * to_vector(base.body.getBaseVel()).squaredNorm(),
        mass / 2);
  }
}

TEST_P(Links, ThrowBackWithRestitutionAndKeepTheMomentum) {
  Real last = 0;
  for (const Real restitution : {0.0, 0.5, 0.9}) {
    SCOPED_TRACE(restitution);
    Simulation of(GetParam());
    btSoftBody& jelly =
        of.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}), {.attach = {.step = {.damping_time = 0.02}}});
    jelly.setRestitution(static_cast<btScalar>(restitution));
    Boxes base(of, 0, 1, {-0.3, 0.25, 0.2});
    base.add_box(-1, {0.1, 0.1, 0.1}).setRestitution(1);
    base.enter();
    base.body.setBaseVel(vector(1, 0, 0));
    of.step(frame, 60);
    const Particles& particles = of.penalty().particles(jelly);
    const Vector3 of_jelly = linear_momentum(particles), of_base = to_vector(base.body.getBaseVel());
    EXPECT_LT((of_jelly + of_base - Vector3(1, 0, 0)).norm(), limit(1e-13, 1e-6));
    EXPECT_GT(of_jelly.x() - of_base.x(), last + 0.02);
    EXPECT_LT(kinetic_energy(particles) + of_base.squaredNorm() / 2, 0.5);
    last = of_jelly.x() - of_base.x();
  }
}

TEST_P(Links, WhoseMotorHoldsThemCarryAtTheMargin) {
  for (const bool sideways : {false, true})
    for (const Real speed : {0.0, 0.05, 0.5}) {
      SCOPED_TRACE("sideways " + std::to_string(sideways) + ", speed " + std::to_string(speed));
      Simulation of(GetParam());
      of.set_gravity({0, -gravity, 0});
      Boxes table(of, 1, 0, {0, -0.1, 0});
      table.slide(0, 1000, sideways ? Vector3(1, 0, 0) : Vector3(0, 1, 0));
      btMultiBodyLinkCollider& top = table.add_box(0, {5, 0.1, 2});
      table.enter();
      btMultiBodyJointMotor motor(&table.body, 0, static_cast<btScalar>(speed), btScalar(1e6));
      table.world().addMultiBodyConstraint(&motor);
      motor.finalizeMultiDof();
      btSoftBody& jelly =
          of.add_jelly(make_box({0.5, 0.5, 0.5}, {3, 3, 3}), {.stiffness = 100,
                                                              .shift = {0, 0.02, 0},
                                                              .body = {.margin = 0.02, .friction = 1},
                                                              .attach = {.step = {.damping_time = 0.01}}});
      of.step(frame, 120);
      EXPECT_NEAR(lowest(jelly) - table.height() - 0.1, 0.02, 3e-4);
      const Vector3 start = center_of_mass(of.penalty().particles(jelly));
      of.step(frame, 60);
      const Vector3 way = center_of_mass(of.penalty().particles(jelly)) - start;
      EXPECT_NEAR(way[sideways ? 0 : 1], speed, 0.01 * speed + 1e-4) << "in a second";
      EXPECT_NEAR(-of.penalty().contact_force(top).force.y(), gravity, 0.01 * gravity);
      table.world().removeMultiBodyConstraint(&motor);
    }
}

TEST_P(Links, OnRailsRestOnWhatIsBelow) {
  for (const Real mass : {0.01, 0.5, 2.0, 20.0}) {
    SCOPED_TRACE(mass);
    Simulation of(GetParam());
    of.set_gravity({0, -gravity, 0});
    of.add_ground();
    of.add_jelly(make_box({0.6, 0.6, 0.6}, {4, 4, 4}), {.stiffness = 100,
                                                        .shift = {-0.3, 0.02, -0.3},
                                                        .body = {.mass = 10, .friction = 1},
                                                        .attach = {.step = {.damping_time = 0.02}}});
    Boxes weight(of, 1, 0, {0, 0.9, 0});
    weight.slide(0, mass, {0, 1, 0});
    const btMultiBodyLinkCollider& box = weight.add_box(0, {0.1, 0.1, 0.1});
    weight.enter();
    of.step(frame, 180);
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < 60; ++k) {
      of.step(frame);
      sum += of.penalty().contact_force(box).force / 60;
      ASSERT_LT(std::abs(Real(weight.body.getJointVel(0))), 2e-3);
    }
    EXPECT_NEAR(sum.y(), mass * gravity, 1e-3 * mass * gravity);
  }
}

TEST_P(Links, OfOneMultibodyShareItsWeight) {
  sim.set_gravity({0, -gravity, 0});
  sim.add_ground();
  sim.add_jelly(make_box({1.2, 0.4, 0.4}, {8, 3, 3}), {.stiffness = 100,
                                                       .shift = {-0.6, 0.02, -0.2},
                                                       .body = {.mass = 10, .friction = 1},
                                                       .attach = {.step = {.damping_time = 0.02}}});
  Boxes raft(sim, 2, 1, {0, 0.56, 0});
  raft.hinge(0, 1, {-0.15, 0, 0}, {-0.15, 0, 0});
  raft.hinge(1, 1, {0.15, 0, 0}, {0.15, 0, 0});
  for (const int link : {-1, 0, 1}) raft.add_box(link, {0.14, 0.1, 0.1});
  raft.enter();
  sim.step(frame, 240);
  Vector3 force = Vector3::Zero();
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    for (const auto& collider : raft.colliders()) force += sim.penalty().contact_force(*collider).force / 60;
    ASSERT_LT(Real(raft.body.getBaseVel().length()), 5e-3);
    ASSERT_LT(std::abs(Real(raft.body.getJointVel(0))) + std::abs(Real(raft.body.getJointVel(1))), 0.05);
  }
  EXPECT_NEAR(force.y(), 3 * gravity, 0.003 * gravity);
}

TEST_P(Links, ThatHitWhatIsHeldSwingNoHigherThanTheyStarted) {
  sim.set_gravity({0, -gravity, 0});
  btSoftBody& jelly = sim.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}), {.shift = {0.12, -1.2, -0.2}});
  for (int i = 0; i < jelly.m_nodes.size(); ++i)
    if (jelly.m_nodes[i].m_x.x() > btScalar(0.5)) jelly.setMass(i, 0);
  Boxes pendulum(sim, 1, 0, {0, 0, 0});
  pendulum.hinge(0, 2, {0, 0, 0}, {0, -1, 0});
  pendulum.add_box(0, {0.1, 0.1, 0.1});
  pendulum.enter(-1);
  Real furthest = -1;
  for (int k = 0; k < 240; ++k) {
    sim.step(frame);
    furthest = std::max(furthest, Real(pendulum.body.getJointPos(0)));
    ASSERT_GT(Real(pendulum.body.getJointPos(0)), -1 - 1e-3);
  }
  EXPECT_GT(furthest, -0.1) << "came there";
  EXPECT_LT(furthest, 0.2) << "went through";
}

TEST_P(Links, ThatMoveWakeWhatSleepsOnThem) {
  sim.set_gravity({0, -gravity, 0});
  Boxes table(sim, 1, 0, {0, -0.1, 0});
  table.slide(0, 1000, {1, 0, 0});
  btMultiBodyLinkCollider& top = table.add_box(0, {5, 0.1, 2});
  table.enter();
  table.body.setCanSleep(true);
  top.forceActivationState(ACTIVE_TAG);
  btSoftBody& jelly =
      sim.add_jelly(make_box({0.5, 0.5, 0.5}, {3, 3, 3}),
                    {.stiffness = 100, .shift = {0, 0.02, 0}, .attach = {.step = {.damping_time = 0.02}}});
  let_sleep(jelly);
  for (int k = 0; k < 600 && jelly.isActive(); ++k) sim.step(frame);
  ASSERT_FALSE(jelly.isActive());
  table.body.setCanSleep(false);
  table.body.wakeUp();
  top.activate();
  table.body.setJointVel(0, 1);
  const Real start = center_of_mass(sim.penalty().particles(jelly)).x();
  sim.step(frame, 60);
  EXPECT_TRUE(jelly.isActive());
  EXPECT_GT(center_of_mass(sim.penalty().particles(jelly)).x() - start, 0.7);
}

INSTANTIATE_TEST_SUITE_P(World, Links, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
