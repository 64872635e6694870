// Joints between rigid bodies that touch soft ones.
#include <BulletDynamics/ConstraintSolver/btConeTwistConstraint.h>
#include <BulletDynamics/ConstraintSolver/btFixedConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofConstraint.h>
#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/ConstraintSolver/btSliderConstraint.h>

#include <functional>

#include "bullet/jointed_bodies.h"

namespace penalty::testing {
namespace {

TEST_P(RigidJoints, ASpringAndAPadCarryAPlate) {
  const Real mass = 5, stiffness = 400, rest = 0.75;
  sim.add_ground();
  add_pad();
  btRigidBody& plate = sim.add_box({0.4, 0.05, 0.4}, mass, {0.5, 0.7, 0.5});
  auto& spring = add<btGeneric6DofSpring2Constraint>(btTypedConstraint::getFixedBody(), plate,
                                                     at_point({0.5, rest, 0.5}), at_point({0, 0, 0}));
  leave_free_along_y(spring);
  spring.enableSpring(1, true);
  spring.setStiffness(1, btScalar(stiffness));
  spring.setDamping(1, 20);
  for (int k = 0; k < 300; ++k) {
    sim.step(frame);
    EXPECT_LT((center(plate) - Vector3(0.5, center(plate).y(), 0.5)).norm(), 1e-4) << k;
    EXPECT_GT(Real(plate.getWorldTransform().getBasis()[1][1]), 1 - 1e-6) << k;
  }
  const Real pressed = sim.penalty().contact_force(plate).force.y();
  EXPECT_GT(pressed, 10) << "the pad carries some of it";
  EXPECT_NEAR(rest - center(plate).y(), (mass * g - pressed) / stiffness, 1e-4);
}

// The same hung on it alone, with a soft sheet on top that weighs what is known.
TEST_P(RigidJoints, ASpringIsStretchedByTheWeightItCarries) {
  const Real mass = 5, stiffness = 2000;
  btRigidBody& plate = sim.add_box({0.6, 0.05, 0.6}, mass, {0.5, 0, 0.5});
  auto& spring = add<btGeneric6DofSpring2Constraint>(btTypedConstraint::getFixedBody(), plate, at_point({0.5, 0, 0.5}),
                                                     at_point({0, 0, 0}));
  leave_free_along_y(spring);
  spring.enableSpring(1, true);
  spring.setStiffness(1, btScalar(stiffness), false);
  spring.setDamping(1, 50, false);
  sim.add_jelly(make_box({1, 0.2, 1}, {5, 1, 5}),
                {.shift = {0, 0.075, 0}, .body = {.mass = 2}, .attach = {.step = {.damping_time = 0.02}}});
  sim.step(frame, 400);
  EXPECT_NEAR(-center(plate).y(), (mass + 2) * g / stiffness, 3e-4);
}

// Nothing acts from outside. Cubes, so that Bullet's gyroscopic term is nothing.
TEST_P(RigidJoints, AFreePairThatASoftBodyHitsKeepsTheMomenta) {
  sim.set_gravity({0, 0, 0});
  btRigidBody& a = sim.add_box({0.3, 0.3, 0.3}, 2, {0, 0, 0});
  btRigidBody& b = sim.add_box({0.3, 0.3, 0.3}, 1, {0.8, 0.1, 0});
  add<btPoint2PointConstraint>(a, b, btVector3(btScalar(0.4), 0, 0), btVector3(btScalar(-0.4), btScalar(-0.1), 0));
  btSoftBody& torus =
      sim.add_jelly(make_torus(0.5, 0.2, 1, 10), {.shift = {0.3, 1, 0.1}, .body = {.mass = 1, .friction = 1}});
  torus.addVelocity({0, -5, 0});
  sim.penalty().synchronize(torus);
  const Totals start = sim.totals();
  int frames = 0;  // of touching; afterwards the pair is Bullet's
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    if (sim.penalty().contacts(torus).empty()) {
      if (frames > 0) break;
      continue;
    }
    ++frames;
    const Totals now = sim.totals();
    EXPECT_LT((now.momentum - start.momentum).norm(), limit(1e-13, 1e-5)) << k;
    EXPECT_LT((now.angular_momentum - start.angular_momentum).norm(), limit(1e-13, 1e-5)) << k;
    EXPECT_LT(now.energy, start.energy) << k;
    EXPECT_LT((on(a, {0.4, 0, 0}) - on(b, {-0.4, -0.1, 0})).norm(), 1e-3) << k;
  }
  EXPECT_GT(frames, 3);
  EXPECT_GT(Real(b.getLinearVelocity().length()), 0.1) << "was hit";
  EXPECT_GT(Real(b.getAngularVelocity().length()), 0.1);
}

// A soft ball swings on a chain of links, of which only the last is anchored to it.
TEST_P(RigidJoints, AChainIsHeldWhereOnlyItsEndTouches) {
  const Vector3 before(0, 0, -0.125), after(0, 0, 0.125);
  btSoftBody& ball = sim.add_jelly(make_ball(0.3, 2), {.attach = {.step = {.damping_time = 0.02}}});
  std::vector<btRigidBody*> links;
  links.reserve(6);
  for (int k = 0; k < 6; ++k) links.push_back(&sim.add_box({0.03, 0.03, 0.1}, 0.2, {0, 0, 0.45 + 0.25 * k}));
  for (std::size_t k = 1; k < links.size(); ++k)
    add<btPoint2PointConstraint>(*links[k - 1], *links[k], to_bullet(after), to_bullet(before));
  add<btPoint2PointConstraint>(*links.back(), to_bullet(after));
  const Vector3 hung_at = on(*links.back(), after);
  for (int i = 0; i < ball.m_nodes.size(); ++i)
    if (ball.m_nodes[i].m_x.z() > btScalar(0.2)) ball.appendAnchor(i, links[0], true);
  ASSERT_GT(ball.m_anchors.size(), 2);
  const Real start = sim.totals().energy;
  Real gap = 0, lowest = 0;
  for (int k = 0; k < 120; ++k) {
    sim.step(frame);
    gap = std::max(gap, (on(*links.back(), after) - hung_at).norm());
    for (std::size_t i = 1; i < links.size(); ++i)
      gap = std::max(gap, (on(*links[i - 1], after) - on(*links[i], before)).norm());
    lowest = std::min(lowest, center(*links[0]).y());
    EXPECT_LT(sim.totals().energy, start + 0.01) << k;
  }
  EXPECT_LT(lowest, -1);
  EXPECT_LT(gap, 1e-3);
}

// Each holds a bar at a point, which falls on the pad with its other end.
TEST_P(RigidJoints, OfEveryKindHold) {
  using Make = std::function<btTypedConstraint&(btRigidBody&, const Vector3&)>;
  const Vector3 end(-0.4, 0, 0);
  const auto in_world = [](const Vector3& at) { return at_point(at); };
  btRigidBody& world = btTypedConstraint::getFixedBody();
  const std::vector<std::pair<const char*, Make>> kinds{
      {"ball",
       [&](btRigidBody& bar, const Vector3&) -> btTypedConstraint& {
         return add<btPoint2PointConstraint>(bar, to_bullet(end));
       }},
      {"hinge",
       [&](btRigidBody& bar, const Vector3&) -> btTypedConstraint& {
         return add<btHingeConstraint>(bar, to_bullet(end), along_z());
       }},
      {"cone",
       [&](btRigidBody& bar, const Vector3& at) -> btTypedConstraint& {
         return add<btConeTwistConstraint>(world, bar, in_world(at), at_point(end));
       }},
      {"six",
       [&](btRigidBody& bar, const Vector3& at) -> btTypedConstraint& {
         auto& joint = add<btGeneric6DofConstraint>(world, bar, in_world(at), at_point(end), false);
         joint.setAngularLowerLimit({0, 0, -1});
         joint.setAngularUpperLimit({0, 0, 1});
         return joint;
       }},
      {"six with springs",
       [&](btRigidBody& bar, const Vector3& at) -> btTypedConstraint& {
         auto& joint = add<btGeneric6DofSpring2Constraint>(world, bar, in_world(at), at_point(end));
         joint.setAngularLowerLimit({0, 0, -1});
         joint.setAngularUpperLimit({0, 0, 1});
         joint.enableSpring(5, true);
         joint.setStiffness(5, 5);
         return joint;
       }},
      {"slider",
       [&](btRigidBody& bar, const Vector3& at) -> btTypedConstraint& {
         auto& joint = add<btSliderConstraint>(world, bar, in_world(at), at_point(end), false);
         joint.setLowerLinLimit(0);
         joint.setUpperLinLimit(0);
         joint.setLowerAngLimit(0);
         joint.setUpperAngLimit(0);
         return joint;
       }},
      {"fixed", [&](btRigidBody& bar, const Vector3& at) -> btTypedConstraint& {
         return add<btFixedConstraint>(world, bar, in_world(at), at_point(end));
       }}};
  sim.add_ground();
  add_pad();
  for (const auto& [name, make] : kinds) {
    SCOPED_TRACE(name);
    btRigidBody& bar = sim.add_box({0.4, 0.03, 0.1}, 3, {0.5, 0.673, 0.5});
    const Vector3 held_at = on(bar, end);
    btTypedConstraint& joint = make(bar, held_at);
    Real drift = 0;
    for (int k = 0; k < 90; ++k) {
      sim.step(frame);
      drift = std::max(drift, (on(bar, end) - held_at).norm());
    }
    EXPECT_LT(drift, 1e-3);
    EXPECT_TRUE(joint.isEnabled());
    remove(joint);
    sim.remove(bar);
  }
}

TEST_P(RigidJoints, WhatNoSoftBodyTouchesIsBulletsToTheLastBit) {
  const auto run = [](Solver solver) {
    Simulation own(GetParam(), solver);
    own.set_gravity({0, -g, 0});
    if (solver == Solver::penalty) own.add_jelly(make_ball(0.3, 1), {.shift = {50, 0, 0}});
    btRigidBody& a = own.add_box({0.3, 0.1, 0.1}, 2, {0, 0, 0});
    btRigidBody& b = own.add_box({0.3, 0.1, 0.1}, 1, {0.8, 0, 0});
    btPoint2PointConstraint held(a, btVector3(btScalar(-0.4), 0, 0));
    btHingeConstraint hinge(a, b, btVector3(btScalar(0.4), 0, 0), btVector3(btScalar(-0.4), 0, 0), along_z(),
                            along_z());
    own.world().addConstraint(&held, true);
    own.world().addConstraint(&hinge, true);
    own.step(frame, 60);
    const std::array<btVector3, 2> ends{a.getWorldTransform().getOrigin(), b.getWorldTransform().getOrigin()};
    own.world().removeConstraint(&held);
    own.world().removeConstraint(&hinge);
    return ends;
  };
  EXPECT_EQ(run(Solver::penalty), run(Solver::bullet));
}

TEST_P(RigidJoints, APairOnAPadFallsAsleepTogetherAndStays) {
  sim.add_ground();
  btSoftBody& pad = add_pad();
  btRigidBody& a = sim.add_box({0.15, 0.05, 0.3}, 1, {0.3, 0.7, 0.5});
  btRigidBody& b = sim.add_box({0.15, 0.05, 0.3}, 1, {0.7, 0.7, 0.5});
  add<btHingeConstraint>(a, b, btVector3(btScalar(0.2), 0, 0), btVector3(btScalar(-0.2), 0, 0), along_z(), along_z());
  for (btCollisionObject* object : std::initializer_list<btCollisionObject*>{&pad, &a, &b}) let_sleep(*object);
  const auto sleeps = [](const btCollisionObject& object) { return object.getActivationState() == ISLAND_SLEEPING; };
  int step = 0;
  for (; step < 1200 && !(sleeps(a) && sleeps(b) && sleeps(pad)); ++step) {
    sim.step(frame);
    EXPECT_EQ(sleeps(a), sleeps(b)) << step;
  }
  EXPECT_LT(step, 1200);
  sim.step(frame, 60);
  EXPECT_TRUE(sleeps(a) && sleeps(b) && sleeps(pad));
  a.activate();
  a.applyCentralImpulse({0, 1, 0});
  sim.step(frame, 3);
  EXPECT_TRUE(a.isActive() && b.isActive());
}

// Three that say the same, and an anchor that leaves the node some of its way: what they gave against each other, and went
// on giving when the block had turned a little, sent it off at 1e14 m/s.
TEST_P(RigidJoints, SlidersOnTheSameLineLetABlockBePulledAlongIt) {
  for (const Real influence : {0.1, 0.3, 0.5, 0.9, 1.0}) {
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    btRigidBody& block = own.add_box({0.3, 0.5, 0.2}, 10, {0.2, 2, 0.1});
    block.setActivationState(DISABLE_DEACTIVATION);
    std::vector<std::unique_ptr<btSliderConstraint>> sliders;
    for (int k = 0; k < 3; ++k) {
      sliders.push_back(std::make_unique<btSliderConstraint>(block, at_point({0.5 * k - 0.25, 0.15 * k, 0}), true));
      own.world().addConstraint(sliders.back().get(), true);
    }
    btSoftBody& cube = own.add_jelly(make_box({1, 1, 1}, {1, 1, 1}), {.body = {.mass = 1}});
    cube.appendAnchor(5, &block, btVector3(0, btScalar(0.2), btScalar(0.1)), true, btScalar(influence));
    for (int k = 0; k < 60; ++k) {
      own.step(frame);
      ASSERT_TRUE(own.penalty().report(cube).finite) << "influence " << influence << ", frame " << k;
      EXPECT_LT((center(block) - Vector3(center(block).x(), 2, 0.1)).norm(), 1e-4) << influence;
      EXPECT_LT(to_vector(block.getLinearVelocity()).norm(), std::sqrt(2 * g * 1)) << "more than its fall could give";
      EXPECT_LT(to_vector(block.getAngularVelocity()).norm(), 1e-2) << influence;
    }
    for (const auto& slider : sliders) own.world().removeConstraint(slider.get());
  }
}

// Of what the joint answers in a substep the anchor is to leave nothing for the next.
TEST_P(RigidJoints, AnAnchorOfPartialInfluencePullsOnABodyOnAPivot) {
  for (const Real influence : {0.02, 0.1, 0.3, 0.6}) {
    SCOPED_TRACE(influence);
    Simulation own(GetParam());
    own.set_gravity({0, 0, 0});
    btRigidBody& block = own.add_box({0.3, 0.5, 0.2}, 6, {0, 2, 0});
    block.setActivationState(DISABLE_DEACTIVATION);
    btPoint2PointConstraint pivot(block, btVector3(btScalar(0.8), btScalar(0.4), 0));
    own.world().addConstraint(&pivot, true);
    const Vector3 held = on(block, {0.8, 0.4, 0});
    btSoftBody& cube =
        own.add_jelly(make_box({1, 1, 1}, {2, 2, 2}), {.stiffness = 1e3, .shift = {2, 2, 0}, .body = {.mass = 2}});
    cube.appendAnchor(5, &block, btVector3(btScalar(-0.3), btScalar(-0.5), btScalar(0.2)), true, btScalar(influence));
    for (int i = 0; i < cube.m_nodes.size(); ++i) cube.m_nodes[i].m_v = {10, 3, 1};
    const Real start = 2.0 / 2 * (100 + 9 + 1);  // [J]
    for (int k = 0; k < 60; ++k) {
      own.step(frame);
      ASSERT_TRUE(own.penalty().report(cube).finite) << "frame " << k;
      ASSERT_LE(own.totals().energy, 1.01 * start) << "frame " << k;
      EXPECT_LT((on(block, {0.8, 0.4, 0}) - held).norm(), 0.01) << "frame " << k;
    }
    own.world().removeConstraint(&pivot);
  }
}

INSTANTIATE_TEST_SUITE_P(BothWorlds, RigidJoints, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
