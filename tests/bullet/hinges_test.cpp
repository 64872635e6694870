// Hinges of rigid bodies that touch soft ones: lids and wheels.
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>

#include "bullet/jointed_bodies.h"

namespace penalty::testing {
namespace {

// A lid of which the left edge is hinged to the world, over a pad.
class Lid : public RigidJoints {
 protected:
  btRigidBody& add_lid(Real mass, Real height = 0.75) {
    sim.add_ground();
    pad = &add_pad();
    return sim.add_box({0.5, 0.02, 0.4}, mass, {0.4, height, 0.5});
  }
  btHingeConstraint& hang(btRigidBody& lid) {
    hinged_at = on(lid, edge);
    return add<btHingeConstraint>(lid, to_bullet(edge), along_z());
  }
  btSoftBody* pad = nullptr;
  Vector3 edge{-0.5, 0, 0}, hinged_at{0, 0, 0};
};

TEST_P(Lid, StaysAtItsHingeAndGainsNoEnergy) {
  for (const Real mass : {1.0, 5.0, 20.0}) {
    SCOPED_TRACE(mass);
    btRigidBody& lid = add_lid(mass, 0.71);
    btHingeConstraint& hinge = hang(lid);
    const Real start = sim.totals().energy;
    Real drift = 0, gain = 0;
    for (int k = 0; k < 180; ++k) {
      sim.step(frame);
      drift = std::max(drift, (on(lid, edge) - hinged_at).norm());
      gain = std::max(gain, sim.totals().energy - start);
    }
    EXPECT_LT(drift, 1e-3);
    EXPECT_LT(gain, 1e-3 * start);
    remove(hinge);
    sim.remove(lid);
    sim.remove(*pad);
  }
}

TEST_P(Lid, LiesOnThePadAndItsHinge) {
  btRigidBody& lid = add_lid(5, 0.71);
  btHingeConstraint& hinge = hang(lid);
  btJointFeedback feedback;
  hinge.setJointFeedback(&feedback);
  hinge.enableFeedback(true);
  sim.step(frame, 400);
  EXPECT_LT(Real(lid.getAngularVelocity().length()), 1e-2);
  const ContactForce pressed = sim.penalty().contact_force(lid);
  const Vector3 arm = center(lid) - hinged_at;
  const Real moment = (pressed.torque + arm.cross(pressed.force)).z();
  EXPECT_NEAR(moment, 5 * g * arm.x(), 0.02 * 5 * g * arm.x());
  EXPECT_NEAR(Real(feedback.m_appliedForceBodyA.y()), 5 * g - pressed.force.y(), 0.02 * 5 * g);
}

TEST_P(Lid, BreaksOffAHingeThatIsTooWeak) {
  for (const Real strength : {0.01, 100.0}) {  // N s in a step; what hangs at it takes about 0.4
    SCOPED_TRACE(strength);
    btRigidBody& lid = add_lid(5, 0.71);
    btHingeConstraint& hinge = hang(lid);
    hinge.setBreakingImpulseThreshold(btScalar(strength));
    sim.step(frame, 30);
    const bool is_weak = strength < 1;
    EXPECT_NE(hinge.isEnabled(), is_weak);
    EXPECT_EQ((on(lid, edge) - hinged_at).norm() > 0.01, is_weak);
    remove(hinge);
    sim.remove(lid);
    sim.remove(*pad);
  }
}

TEST_P(Lid, FallsFromAHingeThatIsSwitchedOff) {
  btRigidBody& lid = add_lid(5, 0.71);
  btHingeConstraint& hinge = hang(lid);
  hinge.setEnabled(false);
  sim.step(frame, 60);
  EXPECT_FALSE(hinge.isEnabled());
  EXPECT_GT((on(lid, edge) - hinged_at).norm(), 0.02);
}

TEST_P(Lid, SeemsHingedToWhoeverIsCalledInAStep) {
  btRigidBody& lid = add_lid(5, 0.71);
  btHingeConstraint& hinge = hang(lid);
  hinge.enableFeedback(true);
  struct Seen {
    btHingeConstraint* hinge;
    int on = 0, with_impulse = 0;
  } seen{&hinge};
  sim.world().setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        Seen& s = *static_cast<Seen*>(world->getWorldUserInfo());
        s.on += s.hinge->isEnabled();
        s.with_impulse += s.hinge->getAppliedImpulse() != 0;
      },
      &seen);
  sim.step(frame, 40);
  EXPECT_EQ(seen.on, 40);
  EXPECT_GT(seen.with_impulse, 30);
}

TEST_P(Lid, MayLoseItsHingeInACallback) {
  btRigidBody& lid = add_lid(5, 0.71);
  hang(lid);
  struct Seen {
    std::vector<std::unique_ptr<btTypedConstraint>>* joints;
    int steps = 0;
  } seen{&joints_};
  sim.world().setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        Seen& s = *static_cast<Seen*>(world->getWorldUserInfo());
        if (++s.steps != 20) return;
        world->removeConstraint(s.joints->back().get());
        s.joints->clear();
      },
      &seen);
  sim.step(frame, 80);
  EXPECT_GT((on(lid, edge) - hinged_at).norm(), 0.02);
}

TEST_P(Lid, StopsWhereItsHingeEnds) {
  btRigidBody& lid = add_lid(5, 0.71);
  hang(lid).setLimit(btScalar(-0.05), btScalar(0.3));
  // A ball on the free end, heavier than the pad could carry.
  btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.1)), 30, {0.7, 0.86, 0.5});
  Real lowest = 0;
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    lowest = std::min(lowest, std::asin(Real(lid.getWorldTransform().getBasis()[1][0])));
  }
  EXPECT_LT(lowest, -0.045) << "came to the stop";
  EXPECT_GT(lowest, -0.055);
  EXPECT_GT(center(ball).y(), 0.3);
}

INSTANTIATE_TEST_SUITE_P(BothWorlds, Lid, both_worlds(), param_name);

// Four wheels on axles, the chassis never touches.
class Car : public RigidJoints {
 protected:
  void SetUp() override {
    RigidJoints::SetUp();
    sim.add_ground();
    add_pad({3, 0.4, 1.5}, {15, 2, 8});
    chassis = &sim.add_box({0.5, 0.1, 0.25}, 20, {0.8, 0.72, 0.75});
    for (int k = 0; k < 4; ++k) {
      btRigidBody& wheel = sim.add_rigid(
          std::make_unique<btCylinderShapeZ>(btVector3(btScalar(radius), btScalar(radius), btScalar(0.05))), 2,
          on(*chassis, axle(k)));
      wheel.setFriction(1);
      hinges.push_back(
          &add<btHingeConstraint>(*chassis, wheel, to_bullet(axle(k)), btVector3(0, 0, 0), along_z(), along_z()));
      wheels.push_back(&wheel);
    }
  }
  static Vector3 axle(int k) { return {(k % 2) ? 0.35 : -0.35, -0.1, (k / 2) ? 0.35 : -0.35}; }
  Real drift() const {
    Real most = 0;
    for (int k = 0; k < 4; ++k) most = std::max(most, (on(*chassis, axle(k)) - center(*wheels[k])).norm());
    return most;
  }
  Real spin(int k) const {
    return Real(((wheels[k]->getAngularVelocity() - chassis->getAngularVelocity())
                     .dot(chassis->getWorldTransform().getBasis() * along_z())));
  }

  static constexpr Real radius = 0.15;
  btRigidBody* chassis = nullptr;
  std::vector<btRigidBody*> wheels;
  std::vector<btHingeConstraint*> hinges;
};

TEST_P(Car, RollsOnAPadWithoutGainingEnergyAndKeepsItsWheels) {
  chassis->setLinearVelocity({2, 0, 0});
  for (btRigidBody* wheel : wheels) {
    wheel->setLinearVelocity({2, 0, 0});
    wheel->setAngularVelocity({0, 0, btScalar(-2 / radius)});
  }
  const Real start = sim.totals().energy;
  for (int k = 0; k < 50; ++k) {
    sim.step(frame);
    EXPECT_LT(sim.totals().energy, start) << k;
    EXPECT_LT(drift(), 1e-3) << k;
  }
  EXPECT_GT(center(*chassis).x(), 1.7) << "rolled";
  EXPECT_GT(Real(chassis->getWorldTransform().getBasis()[1][1]), 0.95);
}

TEST_P(Car, IsDrivenAtTheSpeedOfItsMotors) {
  sim.step(frame, 30);
  // Of the wheel against the chassis: Bullet counts what the chassis does.
  for (btHingeConstraint* hinge : hinges) hinge->enableAngularMotor(true, 6, 2);
  sim.step(frame, 60);
  const Real from = center(*chassis).x();
  Real furthest = 0;
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    EXPECT_LT(drift(), 1e-3) << k;
    for (int wheel = 0; wheel < 4; ++wheel) furthest = std::max(furthest, std::abs(std::abs(spin(wheel)) - 6));
  }
  EXPECT_LT(furthest, 0.06);
  EXPECT_NEAR(std::abs(center(*chassis).x() - from), 6 * (radius + 0.02), 0.15);
}

INSTANTIATE_TEST_SUITE_P(BothWorlds, Car, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
