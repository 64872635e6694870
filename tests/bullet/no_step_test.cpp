// Time steps and gravity that are none: no step is made, and all goes on when they are mended.
#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class NoStep : public WorldTest {
 protected:
  void expect_no_step(btScalar duration, bool first) {
    sim.set_gravity({0, -9.81, 0});
    btSoftBody& body = sim.add_jelly(make_ball(0.25, 2), {.shift = {0, 2, 0}});
    if (!first) sim.step(frame, 5);
    body.m_nodes[3].m_v += btVector3(0, 0, btScalar(0.25));
    const std::vector<Vector3> before = places_of(body);
    sim.world().stepSimulation(duration, 0);
    EXPECT_EQ(places_of(body), before);
    EXPECT_NEAR(Real(body.m_nodes[3].m_v.z()), 0.25, 1e-4) << "what the application wrote stays";
    EXPECT_EQ(sim.penalty().report(body).problem, "the time step is not positive and finite: no step was made");
    EXPECT_EQ(sim.penalty().report(body).finite, std::isfinite(duration));
    const Real speed = Real(body.m_nodes[4].m_v.y());
    sim.step(frame);
    EXPECT_EQ(sim.penalty().report(body).problem, "");
    EXPECT_TRUE(sim.penalty().report(body).finite);
    const auto& particles = sim.penalty().particles(body);
    EXPECT_TRUE(particles.positions.allFinite());
    EXPECT_NEAR(linear_momentum(particles).y(), speed - 9.81 * frame, 1e-3) << "1 kg";
    sim.step(frame, 30);
    EXPECT_LT(lowest(body), 1.2) << "falls";
    sim.remove(body);
  }
};

TEST_P(NoStep, NegativeOnes) {
  for (const bool first : {true, false}) expect_no_step(btScalar(-0.001), first);
}
TEST_P(NoStep, NotANumber) {
  for (const bool first : {true, false}) expect_no_step(nan, first);
}
TEST_P(NoStep, InfiniteOnes) {
  for (const bool first : {true, false}) expect_no_step(inf, first);
  for (const bool first : {true, false}) expect_no_step(-inf, first);
}

// Steps so long that the positions leave what Bullet can write.
TEST_P(NoStep, OnesThatLeadOutOfRange) {
  btSoftBody& body = sim.add_jelly(make_ball(0.25, 1));
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(1000, 0, 0);
  sim.step(frame);
  sim.world().stepSimulation(btScalar(double_bullet ? 1e307 : 1e37), 0);
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      ASSERT_TRUE(to_vector(body.m_nodes[i].m_x).allFinite());
      ASSERT_TRUE(to_vector(body.m_nodes[i].m_v).allFinite());
    }
    EXPECT_TRUE(sim.penalty().particles(body).positions.allFinite());
    sim.step(frame);
  }
}

TEST_P(NoStep, GravityThatIsNoNumberForOneStep) {
  sim.add_ground();
  btSoftBody& body = sim.add_jelly(make_ball(0.25, 2), {.shift = {0, 1, 0}});
  let_sleep(body);
  for (const btScalar bad : {nan, inf}) {
    sim.set_gravity({0, -9.81, 0});
    sim.step(frame, 5);
    const std::vector<Vector3> before = places_of(body);
    sim.info().m_gravity = btVector3(0, bad, 0);
    sim.step(frame);
    EXPECT_EQ(places_of(body), before);
    EXPECT_EQ(sim.penalty().report(body).problem, "the gravity of its world info is not finite");
    EXPECT_FALSE(sim.penalty().report(body).finite);
  }
  sim.set_gravity({0, -9.81, 0});
  const Real before = lowest(body);
  sim.step(frame, 4);
  EXPECT_LT(lowest(body), before);
  EXPECT_LT(sim.penalty().report(body).substeps, 1000);
  sim.step(frame, 60);
  EXPECT_GT(lowest(body), 0);
  EXPECT_TRUE(body.isActive());
}

INSTANTIATE_TEST_SUITE_P(World, NoStep, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
