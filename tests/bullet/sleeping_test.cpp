// Falling asleep and waking up.
#include "bullet/simulation.h"

#include <array>

namespace penalty::testing {
namespace {

class Sleeping : public WorldTest {
 protected:
  void SetUp() override {
    sim.set_gravity({0, -9.81, 0});
    sim.add_ground();
    body = &sim.add_jelly(make_ball(0.3, 2), {.shift = {0, 0.35, 0}, .attach = {.step = {.damping_time = 0.02}}});
    let_sleep(*body);
  }

  // Seconds until all the objects sleep, or -1.
  Real time_to_sleep(std::initializer_list<const btCollisionObject*> objects) {
    for (int step = 1; step <= 3600; ++step) {
      sim.step(frame);
      bool all = true;
      for (const btCollisionObject* object : objects) all = all && object->getActivationState() == ISLAND_SLEEPING;
      if (all) return step * frame;
    }
    return -1;
  }

  btSoftBody* body = nullptr;
};

TEST_P(Sleeping, ABodyAtRestFallsAsleepAndStaysWhereItIs) {
  const Real time = time_to_sleep({body});
  RecordProperty("seconds", std::to_string(time));
  EXPECT_GT(time, 2);
  const PackedVectors before = sim.penalty().particles(*body).positions;
  sim.step(frame, 60);
  EXPECT_EQ(sim.penalty().particles(*body).positions, before);
  EXPECT_EQ(body->getActivationState(), ISLAND_SLEEPING);
}

TEST_P(Sleeping, ARigidBodyThatHitsItWakesIt) {
  ASSERT_GT(time_to_sleep({body}), 0);
  const PackedVectors before = sim.penalty().particles(*body).positions;
  btRigidBody& box = sim.add_box({0.1, 0.1, 0.1}, 1, {0, 1.5, 0});
  Real deepest = 0, lowest_of_box = 2;  // before it rolls off
  for (int step = 0; step < 60; ++step) {
    sim.step(frame);
    deepest = std::max(deepest, (sim.penalty().particles(*body).positions - before).cwiseAbs().maxCoeff());
    if (step < 40) lowest_of_box = std::min(lowest_of_box, Real(box.getWorldTransform().getOrigin().y()));
  }
  EXPECT_TRUE(body->isActive());
  EXPECT_GT(deepest, 0.01) << "gave way";
  EXPECT_GT(lowest_of_box, 0.5) << "did not fall through";
}

TEST_P(Sleeping, ActivateWakesIt) {
  ASSERT_GT(time_to_sleep({body}), 0);
  body->activate();
  for (int i = 0; i < body->m_nodes.size(); ++i) body->m_nodes[i].m_v = btVector3(0, 2, 0);
  const Real before = lowest(*body);
  sim.step(frame, 6);
  EXPECT_GT(lowest(*body), before + 0.1);
}

// Bullet's islands send a body to sleep in the middle of the step: that step counts.
TEST_P(Sleeping, WhatIsSentToSleepInFlightWakesFromWhereItsNodesAre) {
  body->translate(btVector3(0, 5, 0));
  body->setVelocity(btVector3(2, 0, 0));
  body->forceActivationState(WANTS_DEACTIVATION);
  sim.step(frame);
  ASSERT_EQ(body->getActivationState(), ISLAND_SLEEPING);
  const auto gap = [&] {
    Real most = 0;
    const Particles& particles = sim.penalty().particles(*body);
    for (int i = 0; i < particles.size(); ++i)
      most = std::max(most, (to_vector(body->m_nodes[i].m_x) - particles.positions.col(i).head<3>()).norm());
    return most;
  };
  EXPECT_LE(gap(), limit(1e-12, 1e-6));

  body->activate(true);
  for (int i = 0; i < body->m_nodes.size(); ++i) body->m_nodes[i].m_v.setZero();
  const Real start = Real(body->m_nodes[0].m_x.y()), side = Real(body->m_nodes[0].m_x.x());
  sim.step(frame);
  EXPECT_NEAR(Real(body->m_nodes[0].m_x.y()), start - 9.81 * frame * frame / 2, limit(1e-9, 1e-5)) << "falls from rest";
  EXPECT_NEAR(Real(body->m_nodes[0].m_x.x()), side, limit(1e-9, 1e-5));
  EXPECT_LE(gap(), limit(1e-12, 1e-6));
}

TEST_P(Sleeping, ARigidBodyThatRestsOnItSleepsToo) {
  btSoftBody& table = sim.add_jelly(make_box({0.6, 0.3, 0.6}, {4, 2, 4}),
                                    {.shift = {2, 0.025, 0}, .attach = {.step = {.damping_time = 0.02}}});
  btRigidBody& box = sim.add_box({0.2, 0.1, 0.2}, 1, {2.3, 0.46, 0.3});
  let_sleep(table);
  let_sleep(box);
  const Real time = time_to_sleep({&table, &box});
  RecordProperty("seconds", std::to_string(time));
  EXPECT_GT(time, 2) << "box " << box.getActivationState() << " at " << box.getLinearVelocity().length()
                     << " m/s, soft body " << table.getActivationState();
  const Real y = Real(box.getWorldTransform().getOrigin().y());
  sim.step(frame, 120);
  EXPECT_NEAR(Real(box.getWorldTransform().getOrigin().y()), y, 1e-3) << "and neither sinks while asleep";
}

// Balls that hang one on the other, the first on the ground's far end: two ropes, added in either order.
class SleepingTied : public WorldTest {
 protected:
  void tie(bool first_rope_first) {
    sim.set_gravity({0, -9.81, 0});
    sim.add_ground();
    for (int k = 0; k < 3; ++k) {
      bodies[k] =
          &sim.add_jelly(make_ball(0.3, 2), {.shift = {0.9 * k, 0.35, 0}, .attach = {.step = {.damping_time = 0.02}}});
      let_sleep(*bodies[k]);
    }
    for (const int k : first_rope_first ? std::array{0, 1} : std::array{1, 0}) ropes[k] = couple(k, k + 1);
  }

  int couple(int a, int b) {
    Eigen::Matrix3Xd rest(3, 2);
    rest << to_vector(bodies[a]->m_nodes[0].m_x), to_vector(bodies[b]->m_nodes[0].m_x);
    PotentialField rope(rest);
    rope.add<Length>(std::vector<Edge>{{0, 1}}, 50).set_free_play(-infinite, 0);
    return sim.penalty().couple({CouplingPoint::at_node(*bodies[a], 0), CouplingPoint::at_node(*bodies[b], 0)},
                                std::move(rope), 0.01);
  }

  bool all_asleep() const {
    return std::all_of(bodies.begin(), bodies.end(),
                       [](const btSoftBody* body) { return body->getActivationState() == ISLAND_SLEEPING; });
  }

  bool fall_asleep() {
    for (int step = 0; step < 3600 && !all_asleep(); ++step) sim.step(frame);
    return all_asleep();
  }

  std::array<btSoftBody*, 3> bodies{};
  std::array<int, 2> ropes{};
};

TEST_P(SleepingTied, TheyFallAsleepTogetherAndTheWholeChainWakesAtOneEnd) {
  for (const bool first_rope_first : {true, false}) {
    if (bodies[0])
      for (btSoftBody*& body : bodies) sim.remove(*body);
    tie(first_rope_first);
    ASSERT_TRUE(fall_asleep());
    bodies[2]->activate();
    for (int i = 0; i < bodies[2]->m_nodes.size(); ++i) bodies[2]->m_nodes[i].m_v = btVector3(4, 0, 0);
    const Real before = center_of_mass(sim.penalty().particles(*bodies[0])).x();
    sim.step(frame, 60);
    EXPECT_GT(center_of_mass(sim.penalty().particles(*bodies[0])).x(), before + 0.05)
        << "the last one was dragged along";
  }
}

TEST_P(SleepingTied, ABallThatHitsOneWakesTheOther) {
  tie(true);
  ASSERT_TRUE(fall_asleep());
  sim.add_box({0.1, 0.1, 0.1}, 1, {0.9, 1.5, 0});
  bool woken = false;
  for (int step = 0; step < 90; ++step) {
    sim.step(frame);
    woken = woken || (bodies[0]->isActive() && bodies[1]->isActive() && bodies[2]->isActive());
  }
  EXPECT_TRUE(woken);
}

TEST_P(SleepingTied, UncouplingWakesWhatHungOnIt) {
  tie(true);
  ASSERT_TRUE(fall_asleep());
  sim.penalty().uncouple(ropes[1]);
  sim.step(frame);
  EXPECT_TRUE(bodies[1]->isActive() && bodies[2]->isActive());
  EXPECT_TRUE(bodies[0]->isActive()) << "still hangs on the second";
}

TEST_P(SleepingTied, ABodyThatIsSwitchedOffIsNoError) {
  tie(true);
  bodies[1]->forceActivationState(DISABLE_SIMULATION);
  EXPECT_NO_THROW(sim.step(frame, 30));
}

INSTANTIATE_TEST_SUITE_P(World, SleepingTied, both_worlds(), param_name);

// A weight on a rope swings slowly enough for Bullet to think that it rests, but hangs on a body that is awake.
class SlowPendulum : public WorldTest {};

TEST_P(SlowPendulum, SwingsOn) {
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& post =
      sim.add_jelly(make_box({0.2, 0.2, 0.2}, {1, 1, 1}), {.body = {.pinned = {0, 1, 2, 3, 4, 5, 6, 7}}});
  btRigidBody& weight = sim.add_box({0.05, 0.05, 0.05}, 1, {0.15, -1.5, 0});
  let_sleep(weight);
  const Vector3 top = to_vector(post.m_nodes[0].m_x);
  Eigen::Matrix3Xd rest(3, 2);
  rest << top, Vector3(0.15, -1.5, 0);
  PotentialField rope(rest);
  rope.add<Length>(std::vector<Edge>{{0, 1}}, 5000);
  sim.penalty().couple({CouplingPoint::at_node(post, 0), CouplingPoint::on(weight, {0, 0, 0})}, std::move(rope));
  Real late_swing = 0;
  for (int step = 0; step < 720; ++step) {
    sim.step(frame);
    if (step > 480)
      late_swing = std::max(late_swing, std::abs(Real(weight.getWorldTransform().getOrigin().x()) - top.x()));
  }
  EXPECT_GT(late_swing, 0.6 * std::abs(0.15 - top.x())) << "after 8 s";
}

INSTANTIATE_TEST_SUITE_P(World, SlowPendulum, both_worlds(), param_name);

INSTANTIATE_TEST_SUITE_P(World, Sleeping, both_worlds(), param_name);

class SleepingRigid : public WorldTest {};

TEST_P(SleepingRigid, IsWokenByASoftBodyThatFallsOnIt) {
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  btRigidBody& box = sim.add_box({0.3, 0.2, 0.3}, 1, {0, 0.2, 0});
  box.forceActivationState(ISLAND_SLEEPING);
  btSoftBody& body = sim.add_jelly(make_ball(0.3, 2), {.shift = {0.35, 1.2, 0}});
  bool woke = false;
  for (int step = 0; step < 60; ++step) {
    sim.step(frame);
    woke = woke || box.isActive();
  }
  EXPECT_TRUE(woke);
  EXPECT_TRUE(sim.penalty().report(body).finite);
}

INSTANTIATE_TEST_SUITE_P(World, SleepingRigid, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
