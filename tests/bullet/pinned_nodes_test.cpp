// Nodes that are held and rigid bodies that can move.
#include "bullet/simulation.h"

#include <numeric>

namespace penalty::testing {
namespace {

/// A block 1 m wide and 0.5 m high on the origin, of which the nodes from `height` [m] upwards are pinned.
class PinnedNodes : public WorldTest {
 protected:
  static constexpr Real margin = 0.02;

  btSoftBody& add_block(Real height) {
    JellyOptions options{.attach = {.step = {.damping_time = 0.002}}};
    for (int i = 0; i < block.vertices.cols(); ++i)
      if (block.vertices(1, i) > height) options.body.pinned.push_back(i);
    return sim.add_jelly(block, options);
  }

  // A box 0.4 m wide of so many kilograms falls 5 cm on the middle of the upper face, and lies there.
  void carry(btSoftBody& body, Real mass) {
    sim.set_gravity({0, -9.81, 0});
    const Vector3 half(0.2, 0.2, 0.2);
    const Real lying = 0.5 + margin + half.y();
    btRigidBody& box = sim.add_box(half, mass, {0.5, lying + 0.05, 0.5});
    int substeps = 0;
    for (int k = 0; k < 180; ++k) {
      sim.step(frame);
      ASSERT_TRUE(sim.penalty().report(body).finite);
      substeps = std::max(substeps, sim.penalty().report(body).substeps);
      ASSERT_GT(Real(box.getWorldTransform().getOrigin().y()), lying - margin) << "went through in step " << k;
    }
    const Vector3 at = to_vector(box.getWorldTransform().getOrigin());
    RecordProperty("depth_um", std::to_string((lying - at.y()) * 1e6));
    RecordProperty("substeps", substeps);
    EXPECT_NEAR(at.y(), lying, 2e-3);
    EXPECT_LT(std::hypot(at.x() - 0.5, at.z() - 0.5), 2e-3);
    EXPECT_GT(Real(box.getWorldTransform().getBasis()[1][1]), 1 - 1e-5) << "level";
    EXPECT_LT(Real(box.getLinearVelocity().length()), 0.011) << "but for half a substep's fall";
    EXPECT_LE(substeps, 100);
  }

  const TetMesh block = make_box({1, 0.5, 1}, {10, 5, 10});
};

TEST_P(PinnedNodes, OfABodyThatIsHeldAltogetherCarryABox) { carry(add_block(-1), 1); }
TEST_P(PinnedNodes, OfABodyThatIsHeldAltogetherCarryAHeavyBox) { carry(add_block(-1), 1000); }
TEST_P(PinnedNodes, OnTopOfABodyCarryABox) { carry(add_block(0.45), 10); }

TEST_P(PinnedNodes, AreNoneOfTheBusinessOfWhatCannotMove) {
  btSoftBody& body = add_block(-1);
  sim.add_box({1, 0.3, 1}, 0, {0.5, 0, 0.5});
  sim.add_box({1, 0.3, 1}, 0, {0.5, 0.7, 0.5}).setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  sim.step(frame, 10);
  EXPECT_EQ(sim.penalty().report(body).num_contacts, 0);
  EXPECT_EQ(sim.penalty().report(body).substeps, 1) << "free flight";
  EXPECT_EQ(sim.penalty().particles(body).positions.row(1).maxCoeff(), 0.5);
}

TEST_P(PinnedNodes, ThatAreDrivenPushABoxAtTheirSpeed) {
  // It has the speed of the nodes from the first touch on, and nearly does not bounce.
  btSoftBody& body = add_block(-1);
  btRigidBody& box = sim.add_box({0.2, 0.3, 0.6}, 50, {-0.3, 0.25, 0.5});
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(-2, 0, 0);
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    ASSERT_EQ(sim.penalty().report(body).retries, 0);
    ASSERT_EQ(Real(body.m_nodes[0].m_v.x()), -2);
  }
  EXPECT_NEAR(Real(box.getLinearVelocity().x()), -2, 0.02);
  EXPECT_NEAR(Real(box.getWorldTransform().getOrigin().x()), sim.penalty().particles(body).positions(0, 0) - 0.22,
              0.02);
  EXPECT_LT(Real(box.getAngularVelocity().length()), 0.02);
}

TEST_P(PinnedNodes, ThatAreDrivenWakeAndPushASleepingBox) {
  btSoftBody& body = add_block(-1);
  btRigidBody& box = sim.add_box({0.2, 0.3, 0.6}, 50, {-0.3, 0.25, 0.5});
  box.forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(-2, 0, 0);
  sim.step(frame, 30);
  EXPECT_TRUE(box.isActive());
  EXPECT_NEAR(Real(box.getLinearVelocity().x()), -2, 0.02);
}

INSTANTIATE_TEST_SUITE_P(World, PinnedNodes, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
