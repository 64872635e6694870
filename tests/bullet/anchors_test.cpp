// Bullet's anchors of attached bodies: exact, in both worlds, by either of Bullet's calls.
#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Anchors : public WorldTest {
 protected:
  btSoftBody& add_box(const Vector3& at, Integrator integrator = Integrator::automatic) {
    return sim.add_jelly(make_box({0.6, 0.4, 0.6}, {3, 2, 3}),
                         {.shift = at, .attach = {.step = {.integrator = integrator, .damping_time = 0.01}}});
  }

  // The nodes where `holds` says so, at where they are.
  template <class Holds>
  void anchor(btSoftBody& body, btRigidBody& rigid, bool deformable, const Holds& holds) {
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const Vector3 x = to_vector(body.m_nodes[i].m_x);
      if (!holds(x)) continue;
      if (deformable)
        body.appendDeformableAnchor(i, &rigid);
      else
        body.appendAnchor(i, &rigid);
      anchored_.push_back({&body.m_nodes[i], &rigid, rigid.getWorldTransform().invXform(body.m_nodes[i].m_x)});
    }
  }

  // The largest way between a node and its anchor [m].
  Real gap() const {
    Real most = 0;
    for (const auto& [node, rigid, local] : anchored_)
      most = std::max(most, Real((rigid->getWorldTransform() * local).distance(node->m_x)));
    return most;
  }

  void expect_to_hold(int frames) {
    const Real start = sim.totals().energy;
    const Real noise = limit(1e-9, 1e-4) * std::abs(start);
    for (int k = 0; k < frames; ++k) {
      sim.step(frame);
      ASSERT_LT(gap(), 0.001) << "frame " << k;
      ASSERT_LE(sim.totals().energy, start + noise) << "frame " << k;
    }
  }

  struct Anchored {
    const btSoftBody::Node* node;
    const btRigidBody* rigid;
    btVector3 local;
  };
  std::vector<Anchored> anchored_;
};

const auto at_two_corners = [](const Vector3& x) { return x.y() > 1.39 && x.z() < 0.01; };
const auto at_top = [](const Vector3& x) { return x.y() > 1.39; };

TEST_P(Anchors, ToAStaticBodyHoldABodyThatHangs) {
  for (const bool deformable : {false, true})
    for (const bool many : {false, true}) {
      SCOPED_TRACE(deformable);
      sim.set_gravity({0, -9.81, 0});
      btSoftBody& body = add_box({0, 1, 0});
      btRigidBody& beam = sim.add_box({1, 0.1, 1}, 0, {0.3, 1.6, 0.3});
      if (many)
        anchor(body, beam, deformable, at_top);
      else
        anchor(body, beam, deformable, at_two_corners);
      expect_to_hold(150);
      EXPECT_GT(lowest(body), many ? 0.9 : 0.5);
      anchored_.clear();
      sim.remove(body);
      sim.remove(beam);
    }
}

TEST_P(Anchors, ToAFreeBodyKeepMomentaAndEnergy) {
  for (const bool deformable : {false, true})
    for (const bool many : {false, true}) {
      SCOPED_TRACE(deformable);
      btSoftBody& body = add_box({0, 1, 0});
      btRigidBody& box = sim.add_box({0.1, 0.1, 0.1}, 1, {0.3, 1.6, 0.1});
      for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(1, 2, -1);
      if (many)
        anchor(body, box, deformable, at_top);
      else
        anchor(body, box, deformable, at_two_corners);
      sim.penalty().synchronize(body);
      const Totals before = sim.totals();
      expect_to_hold(120);
      const Totals after = sim.totals();
      EXPECT_LT((after.momentum - before.momentum).norm(), limit(1e-11, 1e-5));
      EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), limit(1e-11, 1e-4));
      anchored_.clear();
      sim.remove(body);
      sim.remove(box);
    }
}

TEST_P(Anchors, HoldInImplicitSteps) {
  for (const bool is_free : {false, true})
    for (const bool deformable : {false, true}) {
      SCOPED_TRACE(is_free);
      sim.set_gravity(is_free ? Vector3(0, 0, 0) : Vector3(0, -9.81, 0));
      btSoftBody& body = add_box({0, 1, 0}, Integrator::implicit_step);
      btRigidBody& box = sim.add_box({0.1, 0.1, 0.1}, is_free ? 1 : 0, {0.3, 1.6, 0.1});
      if (is_free)
        for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(1, 2, -1);
      anchor(body, box, deformable, at_two_corners);
      sim.penalty().synchronize(body);
      const Totals before = sim.totals();
      expect_to_hold(120);
      EXPECT_EQ(sim.penalty().report(body).integrator, Integrator::implicit_step);
      if (is_free) {
        EXPECT_LT((sim.totals().momentum - before.momentum).norm(), limit(1e-11, 1e-5));
        EXPECT_LT((sim.totals().angular_momentum - before.angular_momentum).norm(), limit(1e-11, 1e-4));
      }
      anchored_.clear();
      sim.remove(body);
      sim.remove(box);
    }
}

TEST_P(Anchors, CarryAWeightBelowABodyThatIsPinned) {
  sim.set_gravity({0, -9.81, 0});
  const TetMesh mesh = make_box({0.6, 0.4, 0.6}, {3, 2, 3});
  JellyOptions options{.stiffness = 100, .shift = {0, 1, 0}, .attach = {.step = {.damping_time = 0.02}}};
  for (int i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.vertices(1, i) > 0.39) options.body.pinned.push_back(i);
  btSoftBody& body = sim.add_jelly(mesh, options);
  btRigidBody& weight = sim.add_box({0.3, 0.1, 0.3}, 1, {0.3, 0.88, 0.3});
  anchor(body, weight, false, [](const Vector3& x) { return x.y() < 1.01; });
  expect_to_hold(240);
  EXPECT_LT(Real(weight.getLinearVelocity().length()), 0.05);
  EXPECT_NEAR(Real(weight.getWorldTransform().getOrigin().y()), 0.88, 0.05);
  EXPECT_GT(Real(weight.getWorldTransform().getBasis()[1][1]), 0.999);
}

TEST_P(Anchors, FollowAKinematicBody) {
  for (const bool deformable : {false, true}) {
    btSoftBody& body = add_box({0, 1, 0});
    btRigidBody& hand = sim.add_box({0.1, 0.1, 0.1}, 0, {0.3, 1.5, 0});
    hand.setCollisionFlags(hand.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    hand.forceActivationState(DISABLE_DEACTIVATION);
    anchor(body, hand, deformable, at_two_corners);
    for (int k = 1; k <= 120; ++k) {
      const Real t = k * frame;
      hand.setWorldTransform(btTransform(btQuaternion(btVector3(0, 1, 0), static_cast<btScalar>(t)),
                                         to_bullet(Vector3(0.3 + 0.5 * t, 1.5 + 0.2 * t, 0))));
      sim.step(frame);
      ASSERT_LT(gap(), 0.001) << "frame " << k;
    }
    EXPECT_GT(center_of_mass(sim.penalty().particles(body)).x(), 0.8);
    anchored_.clear();
    sim.remove(body);
    sim.remove(hand);
  }
}

TEST_P(Anchors, HoldWithTheirInfluenceAndUntilTheyAreRemoved) {
  sim.set_gravity({0, -9.81, 0});
  btRigidBody& beam = sim.add_box({1, 0.1, 1}, 0, {0.3, 1.7, 0.3});
  btSoftBody& free = add_box({3, 1, 0});
  btSoftBody& held = add_box({0, 1, 0});
  for (btSoftBody* body : {&free, &held})
    for (int i = 0; i < body->m_nodes.size(); ++i)
      if (Real(body->m_nodes[i].m_x.y()) > 1.39) body->appendAnchor(i, &beam, false, body == &free ? 0 : btScalar(0.5));
  sim.step(frame, 30);
  EXPECT_LT(lowest(free), 0);
  EXPECT_GT(lowest(held), 0.9);
  held.m_anchors.clear();
  sim.step(frame, 30);
  EXPECT_LT(lowest(held), 0.1) << "falls";
}

TEST_P(Anchors, OfABodyThatHasLeftTheWorldAreReported) {
  sim.set_gravity({0, -9.81, 0});
  btRigidBody& beam = sim.add_box({1, 0.1, 1}, 0, {0.3, 1.7, 0.3});
  btSoftBody& body = add_box({0, 1, 0});
  body.appendAnchor(0, &beam);
  sim.step(frame, 5);
  sim.remove(beam);
  sim.step(frame, 5);
  EXPECT_NE(sim.penalty().report(body).problem.find("has left the world"), std::string::npos)
      << sim.penalty().report(body).problem;
  const Real height = lowest(body);
  body.m_anchors.clear();
  sim.step(frame, 30);
  EXPECT_TRUE(sim.penalty().report(body).problem.empty());
  EXPECT_LT(lowest(body), height - 0.5);
}

INSTANTIATE_TEST_SUITE_P(World, Anchors, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
