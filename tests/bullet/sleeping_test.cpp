// Falling asleep and waking up. Only the deformable world lets soft bodies sleep.
#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Real frame = 1.0 / 60;

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
  Real deepest = 0;
  for (int step = 0; step < 60; ++step) {
    sim.step(frame);
    deepest = std::max(deepest, (sim.penalty().particles(*body).positions - before).cwiseAbs().maxCoeff());
  }
  EXPECT_TRUE(body->isActive());
  EXPECT_GT(deepest, 0.01) << "gave way";
  EXPECT_GT(Real(box.getWorldTransform().getOrigin().y()), 0.15) << "did not fall through";
}

TEST_P(Sleeping, ActivateWakesIt) {
  ASSERT_GT(time_to_sleep({body}), 0);
  body->activate();
  for (int i = 0; i < body->m_nodes.size(); ++i) body->m_nodes[i].m_v = btVector3(0, 2, 0);
  const Real before = lowest(*body);
  sim.step(frame, 6);
  EXPECT_GT(lowest(*body), before + 0.1);
}

TEST_P(Sleeping, ARigidBodyThatRestsOnItSleepsToo) {
  btSoftBody& table = sim.add_jelly(make_box({0.6, 0.3, 0.6}, {4, 2, 4}),
                                    {.shift = {2, 0.025, 0}, .attach = {.step = {.damping_time = 0.02}}});
  btRigidBody& box = sim.add_box({0.2, 0.1, 0.2}, 1, {2.3, 0.46, 0.3});
  let_sleep(table);
  let_sleep(box);
  const Real time = time_to_sleep({&table, &box});
  RecordProperty("seconds", std::to_string(time));
  EXPECT_GT(time, 2) << "box " << box.getActivationState() << " at " << box.getLinearVelocity().length() << " m/s, soft body "
                     << table.getActivationState();
  const Real y = Real(box.getWorldTransform().getOrigin().y());
  sim.step(frame, 120);
  EXPECT_NEAR(Real(box.getWorldTransform().getOrigin().y()), y, 1e-3) << "and neither sinks while asleep";
}

INSTANTIATE_TEST_SUITE_P(World, Sleeping, deformable_world(), param_name);

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
