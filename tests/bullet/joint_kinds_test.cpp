// Joints that few use, between rigid bodies that are near soft ones.
#include <BulletDynamics/ConstraintSolver/btGearConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpringConstraint.h>
#include <BulletDynamics/ConstraintSolver/btHinge2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btUniversalConstraint.h>

#include <cmath>
#include <memory>
#include <vector>

#include "bullet/jointed_bodies.h"

namespace penalty::testing {
namespace {

class JointKinds : public RigidJoints {
 protected:
  static btRigidBody& the_world() { return btTypedConstraint::getFixedBody(); }

  static void damp_along_x(btGeneric6DofSpring2Constraint& joint, Real damping) {
    joint.setLinearLowerLimit({1, 0, 0});  // free
    joint.setLinearUpperLimit({-1, 0, 0});
    joint.enableSpring(0, true);
    joint.setStiffness(0, 0, false);
    joint.setDamping(0, static_cast<btScalar>(damping), false);
  }

  // On top of a plate, with its weight.
  btSoftBody& add_load(Real mass) {
    return sim.add_jelly(make_box({1, 0.2, 1}, {5, 1, 5}),
                         {.shift = {0, 0.075, 0}, .body = {.mass = mass}, .attach = {.step = {.damping_time = 0.02}}});
  }
  // Next to no mass, tied to a plate: its joints are in our step.
  btSoftBody& add_rider(btRigidBody& plate) {
    btSoftBody& rider = sim.add_jelly(make_box({0.1, 0.1, 0.1}, {1, 1, 1}),
                                      {.stiffness = 1e-6, .shift = {0.5, 0.2, 0.5}, .body = {.mass = 1e-6}});
    rider.appendAnchor(0, &plate, true);
    return rider;
  }
};

TEST_P(JointKinds, AUniversalJointHoldsItsPointAndItsCross) {
  sim.add_ground();
  add_pad();
  const Vector3 end(-0.4, 0, 0);
  btRigidBody& bar = sim.add_box({0.4, 0.03, 0.1}, 3, {0.5, 0.673, 0.5});
  const Vector3 held_at = on(bar, end);
  const btVector3 anchor = to_bullet(held_at), upright(0, 1, 0), across(0, 0, 1);
  auto& joint = add<btUniversalConstraint>(the_world(), bar, anchor, upright, across);
  bar.setAngularVelocity({0, 1, 1});
  bar.setLinearVelocity(bar.getAngularVelocity().cross(btVector3(btScalar(0.4), 0, 0)));
  Real drift = 0, bent = 0;
  for (int k = 0; k < 90; ++k) {
    sim.step(frame);
    drift = std::max(drift, (on(bar, end) - held_at).norm());
    const btVector3 turned = bar.getWorldTransform().getBasis() * across;
    bent = std::max(bent, std::abs(Real(turned.dot(upright))));
  }
  EXPECT_LT(drift, 1e-3);
  EXPECT_LT(bent, 2e-3) << "the axes of the cross stay at right angles";
  EXPECT_TRUE(joint.isEnabled());
}

// Its first axis is that of the suspension.
TEST_P(JointKinds, AHinge2SinksByTheWeightOnItsSpring) {
  const Real mass = 5, load = 2, stiffness = 2000;
  btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
  btVector3 anchor(btScalar(0.5), 0, btScalar(0.5)), upright(0, 1, 0), axle(1, 0, 0);
  auto& joint = add<btHinge2Constraint>(the_world(), plate, anchor, upright, axle);
  joint.setStiffness(2, btScalar(stiffness), false);
  joint.setDamping(2, 50, false);
  joint.setAngularLowerLimit({0, 0, 0});
  joint.setAngularUpperLimit({0, 0, 0});
  add_load(load);
  sim.step(frame, 400);
  EXPECT_NEAR(-center(plate).y(), (mass + load) * g / stiffness, 3e-4);
  EXPECT_LT(std::hypot(center(plate).x() - 0.5, center(plate).z() - 0.5), 1e-3);
}

TEST_P(JointKinds, AnOldSpringIsStretchedByTheWeightItCarries) {
  const Real mass = 5, load = 2, stiffness = 2000;
  btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
  auto& joint =
      add<btGeneric6DofSpringConstraint>(the_world(), plate, at_point({0.5, 0, 0.5}), at_point({0, 0, 0}), true);
  leave_free_along_y(joint);
  joint.enableSpring(1, true);
  joint.setStiffness(1, btScalar(stiffness));
  joint.setDamping(1, btScalar(0.1));
  joint.setEquilibriumPoint();
  add_load(load);
  Real mean = 0;  // it swings about that, as nothing damps it
  sim.step(frame, 60);
  for (int k = 0; k < 600; ++k) {
    sim.step(frame);
    mean -= center(plate).y() / 600;
  }
  EXPECT_NEAR(mean, (mass + load) * g / stiffness, 1e-3);
  EXPECT_LT(std::hypot(center(plate).x() - 0.5, center(plate).z() - 0.5), 1e-3);
}

// x'' = -k x - c v, of which the slow root is all that is left soon.
TEST_P(JointKinds, ADamperThatIsStrongerThanItsSpringLetsItCreep) {
  sim.set_gravity({0, 0, 0});
  const Real mass = 5, stiffness = 100, damping = 200, start = 0.1;
  btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
  auto& joint =
      add<btGeneric6DofSpring2Constraint>(the_world(), plate, at_point({0.5 - start, 0, 0.5}), at_point({0, 0, 0}));
  joint.setLinearLowerLimit({1, 0, 0});  // free
  joint.setLinearUpperLimit({-1, 0, 0});
  joint.setAngularLowerLimit({0, 0, 0});
  joint.setAngularUpperLimit({0, 0, 0});
  joint.enableSpring(0, true);
  joint.setStiffness(0, btScalar(stiffness), false);
  joint.setDamping(0, btScalar(damping), false);
  add_rider(plate);
  const Real root = std::sqrt(damping * damping - 4 * mass * stiffness);
  const Real slow = (damping - root) / (2 * mass), fast = (damping + root) / (2 * mass);
  for (int k = 1; k <= 60; ++k) {
    sim.step(frame);
    const Real t = k * frame;
    const Real x = start * (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow);
    EXPECT_NEAR(center(plate).x() - 0.5 + start, x, 0.01 * start) << k;
  }
}

// Without a spring what moves at v0 goes v0 m / c in all, and never back.
TEST_P(JointKinds, ADamperOfAnyStrengthTakesTheSpeed) {
  sim.set_gravity({0, 0, 0});
  const Real mass = 5;
  for (const Real strength : {0.1, 1.0, 10.0, 1e3, 1e6}) {  // c h / m, h a frame
    SCOPED_TRACE(strength);
    const Real damping = strength * mass / frame;
    btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
    auto& joint = add<btGeneric6DofSpring2Constraint>(the_world(), plate, at_point({0.5, 0, 0.5}), at_point({0, 0, 0}));
    damp_along_x(joint, damping);
    joint.setAngularLowerLimit({0, 0, 0});
    joint.setAngularUpperLimit({0, 0, 0});
    plate.setLinearVelocity({1, 0, 0});
    btSoftBody& rider = add_rider(plate);
    sim.step(frame, 60);
    const Real way = mass / damping * -std::expm1(-damping / mass);
    EXPECT_NEAR(center(plate).x() - 0.5, way, 0.02 * way + 0.5 * frame / 8);  // of half a substep at v0
    EXPECT_GT(center(plate).x() - 0.5, -limit(1e-12, 1e-6));
    EXPECT_NEAR(Real(plate.getLinearVelocity().x()), std::exp(-damping / mass), 2e-3);
    sim.remove(rider);
    remove(joint);
    sim.remove(plate);
  }
}

// I w' = -c w
TEST_P(JointKinds, ADamperOfAnyStrengthTakesTheSpin) {
  sim.set_gravity({0, 0, 0});
  for (const Real mass : {0.05, 5.0, 500.0})
    for (const Real strength : {0.1, 1.0, 10.0, 1e3}) {  // c h / I, h a frame
      SCOPED_TRACE(std::to_string(strength) + " of " + std::to_string(mass) + " kg");
      btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
      const Real inertia = mass / 3 * (0.05 * 0.05 + 0.6 * 0.6), damping = strength * inertia / frame;
      auto& joint =
          add<btGeneric6DofSpring2Constraint>(the_world(), plate, at_point({0.5, 0, 0.5}), at_point({0, 0, 0}));
      joint.setLimit(3, 1, -1);  // free
      joint.enableSpring(3, true);
      joint.setStiffness(3, 0, false);
      joint.setDamping(3, static_cast<btScalar>(damping), false);
      plate.setAngularVelocity({1, 0, 0});
      btSoftBody& rider = add_rider(plate);
      sim.step(frame, 60);
      const btVector3 across = plate.getWorldTransform().getBasis() * along_z();
      const Real angle = inertia / damping * -std::expm1(-damping / inertia);
      EXPECT_NEAR(std::atan2(-Real(across.y()), Real(across.z())), angle, 0.02 * angle + 0.5 * frame / 8);
      EXPECT_NEAR(Real(plate.getAngularVelocity().x()), std::exp(-damping / inertia), 2e-3);
      sim.remove(rider);
      remove(joint);
      sim.remove(plate);
    }
}

// m v' = m g - c v
TEST_P(JointKinds, ABodyOnADamperFallsAtTheSpeedWhoseForceIsItsWeight) {
  for (const Real mass : {0.05, 5.0, 500.0})
    for (const Real strength : {0.1, 1.0, 10.0, 1e3}) {
      SCOPED_TRACE(std::to_string(strength) + " of " + std::to_string(mass) + " kg");
      const Real damping = strength * mass / frame, fastest = mass * g / damping;
      btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
      auto& joint =
          add<btGeneric6DofSpring2Constraint>(the_world(), plate, at_point({0.5, 0, 0.5}), at_point({0, 0, 0}));
      leave_free_along_y(joint);
      joint.enableSpring(1, true);
      joint.setStiffness(1, 0, false);
      joint.setDamping(1, static_cast<btScalar>(damping), false);
      btSoftBody& rider = add_rider(plate);
      sim.step(frame, 60);
      EXPECT_NEAR(-Real(plate.getLinearVelocity().y()), -fastest * std::expm1(-damping / mass), 0.01 * fastest);
      const Real way = fastest * (1 + mass / damping * std::expm1(-damping / mass));
      EXPECT_NEAR(-center(plate).y(), way, 0.02 * way);
      sim.remove(rider);
      remove(joint);
      sim.remove(plate);
    }
}

// x = a exp(-c t / 2 m) (cos w t + c / (2 m w) sin w t), w² = k / m - (c / 2 m)²
TEST_P(JointKinds, ADamperThatIsWeakerThanItsSpringLetsItSwing) {
  sim.set_gravity({0, 0, 0});
  const Real mass = 5, stiffness = 500, damping = 10, start = 0.1;
  btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
  auto& joint =
      add<btGeneric6DofSpring2Constraint>(the_world(), plate, at_point({0.5 - start, 0, 0.5}), at_point({0, 0, 0}));
  damp_along_x(joint, damping);
  joint.setStiffness(0, btScalar(stiffness), false);
  add_rider(plate);
  const Real decay = damping / (2 * mass), w = std::sqrt(stiffness / mass - decay * decay);
  for (int k = 1; k <= 90; ++k) {
    sim.step(frame);
    const Real t = k * frame;
    const Real x = start * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
    EXPECT_NEAR(center(plate).x() - 0.5 + start, x, 0.05 * start) << k;
  }
}

// Far from the centre of a body a damper moves more than its mass.
TEST_P(JointKinds, ADamperOnALeverTakesEnergyOnly) {
  sim.set_gravity({0, 0, 0});
  const Real mass = 5;
  for (const bool is_pair : {false, true})
    for (const Real strength : {0.3, 3.0, 30.0, 1e4}) {
      SCOPED_TRACE(std::to_string(strength) + (is_pair ? ", two bodies" : ", one body"));
      btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
      btRigidBody& heavy = sim.add_box({0.2, 0.2, 0.2}, 100 * mass, {3, 0, 3});
      auto& joint = add<btGeneric6DofSpring2Constraint>(
          is_pair ? heavy : the_world(), plate, at_point(is_pair ? Vector3(-1.9, 0, -3.1) : Vector3(1.1, 0, -0.1)),
          at_point({0.6, 0, -0.6}));
      damp_along_x(joint, strength * mass / frame);
      for (int axis = 3; axis < 6; ++axis) joint.setLimit(axis, 1, -1);
      plate.setLinearVelocity({1, 0, 0});
      plate.setAngularVelocity({0, 3, 0});
      btSoftBody& rider = add_rider(plate);
      Real last = sim.totals().energy;
      const Totals start = sim.totals();
      for (int k = 0; k < 60; ++k) {
        sim.step(frame);
        const Real energy = sim.totals().energy;
        ASSERT_LE(energy, last + 1e-3 * start.energy) << k;
        last = energy;
      }
      EXPECT_LT(last, 0.9 * start.energy);
      if (is_pair) {
        EXPECT_LT((sim.totals().momentum - start.momentum).norm(), limit(1e-10, 1e-4));
        EXPECT_LT((sim.totals().angular_momentum - start.angular_momentum).norm(), limit(1e-8, 1e-3));  // of 8
      }
      sim.remove(rider);
      remove(joint);
      sim.remove(heavy);
      sim.remove(plate);
    }
}

// Two wheels on axles in the world: a motor turns one, and the gear the other.
TEST_P(JointKinds, AGearTurnsTheOtherWheelByItsRatio) {
  sim.set_gravity({0, 0, 0});
  btRigidBody& one = sim.add_box({0.3, 0.05, 0.3}, 1, {0.2, 0, 0.5});
  add_rider(one);
  btRigidBody& two = sim.add_box({0.1, 0.05, 0.1}, 1, {0.8, 0, 0.5});
  const btVector3 upright(0, 1, 0), center_of_wheel(0, 0, 0);
  auto& axle = add<btHingeConstraint>(one, center_of_wheel, upright);
  add<btHingeConstraint>(two, center_of_wheel, upright);
  axle.enableAngularMotor(true, 2, 1);
  const Real ratio = 3;
  add<btGearConstraint>(one, two, upright, upright, btScalar(1 / ratio));
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    EXPECT_NEAR(Real(one.getAngularVelocity().y()), -Real(two.getAngularVelocity().y()) / ratio, 5e-3) << k;
  }
  EXPECT_NEAR(std::abs(Real(one.getAngularVelocity().y())), 2, 0.02);
  EXPECT_LT((center(one) - Vector3(0.2, 0, 0.5)).norm() + (center(two) - Vector3(0.8, 0, 0.5)).norm(), 1e-3);
}

// Bullet's few iterations stretch a chain by centimetres. When its end comes near a soft body it is ours from one step to
// the next, comes together slowly, and gathers no speed from that.
TEST_P(JointKinds, AChainThatBulletHasStretchedIsTakenOverWithoutAJerk) {
  sim.add_ground();
  add_pad({1, 0.4, 1}, {6, 3, 6});
  const Real length = 0.1, top = 1.5;
  const btVector3 up(0, btScalar(length / 2), 0), down = -up;
  std::vector<btRigidBody*> links;
  links.reserve(10);
  for (int k = 0; k < 10; ++k)
    links.push_back(&sim.add_box({0.03, 0.04, 0.03}, 1, {0.5, top - (k + 0.5) * length, 0.5}));
  add<btHingeConstraint>(*links[0], up, along_z());
  for (std::size_t k = 1; k < links.size(); ++k)
    add<btHingeConstraint>(*links[k - 1], *links[k], down, up, along_z(), along_z());
  links.back()->setLinearVelocity({btScalar(0.3), 0, 0});
  Real fastest = 0;
  for (int k = 0; k < 120; ++k) {
    sim.step(frame);
    for (const btRigidBody* link : links) fastest = std::max(fastest, Real(link->getLinearVelocity().length()));
  }
  EXPECT_LT(fastest, 1.5);
}

INSTANTIATE_TEST_SUITE_P(BothWorlds, JointKinds, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
