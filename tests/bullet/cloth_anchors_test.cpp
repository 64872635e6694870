// Cloth that is anchored to a box: light cloth on a heavy box, heavy cloth on a light one, at one node or at many.
#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace penalty::testing {
namespace {

class ClothAnchors : public WorldTest {
 protected:
  // A level sheet 0.5 m wide, of so many kilograms and as stiff, at a height.
  btSoftBody& add_cloth(Real mass, Real height, Real damping_time = 0.002) {
    TriangleSurface sheet = make_sheet(0.5, 0.5, 10, 10);
    const Eigen::Matrix3Xd upright = sheet.vertices;
    sheet.vertices.row(1).setConstant(height);
    sheet.vertices.row(2) = -upright.row(1);
    center = sheet.vertices.rowwise().mean();
    PotentialField field(sheet.vertices);
    field.add<Length>(edges_of(sheet.triangles), 20 * mass);
    btSoftBody& cloth = sim.add(make_soft_body(sim.info(), sheet, {.mass = mass, .margin = 0.005}));
    sim.penalty().attach(cloth, std::move(field), {.step = {.damping_time = damping_time}, .self_contact = false});
    return cloth;
  }

  // The nodes that are nearest to its middle, by either of Bullet's calls.
  void anchor(btSoftBody& cloth, btRigidBody& rigid, int count) {
    std::vector<int> nodes(static_cast<std::size_t>(cloth.m_nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = static_cast<int>(i);
    const auto distance = [&](int i) {  // to the micrometre: what is as far comes in its order
      return std::lround(1e6 * (to_vector(cloth.m_nodes[i].m_x) - center).norm());
    };
    std::sort(nodes.begin(), nodes.end(),
              [&](int a, int b) { return std::pair(distance(a), a) < std::pair(distance(b), b); });
    for (int k = 0; k < count; ++k) anchor_node(cloth, nodes[static_cast<std::size_t>(k)], rigid);
  }

  void anchor_node(btSoftBody& body, int node, btRigidBody& rigid) {
    if (anchored.size() % 2 == 0)
      body.appendAnchor(node, &rigid);
    else
      body.appendDeformableAnchor(node, &rigid);
    anchored.push_back({&body.m_nodes[node], &rigid, rigid.getWorldTransform().invXform(body.m_nodes[node].m_x)});
  }

  Real gap() const {
    Real most = 0;
    for (const auto& [node, rigid, local] : anchored)
      most = std::max(most, Real((rigid->getWorldTransform() * local).distance(node->m_x)));
    return most;
  }

  // Returns the largest way between a node and its anchor [m].
  Real expect_no_energy(int frames) {
    const Real start = sim.totals().energy, noise = limit(1e-9, 1e-4) * (1 + std::abs(start));
    Real largest = 0;
    for (int k = 0; k < frames; ++k) {
      sim.step(frame);
      largest = std::max(largest, gap());
      EXPECT_LE(sim.totals().energy, start + noise) << "frame " << k;
      if (HasFailure()) break;
    }
    RecordProperty("gap_um_" + std::to_string(runs_++), std::to_string(1e6 * largest));
    return largest;
  }

  template <class Run>
  void for_all(const Run& run) {
    for (const Real mass : {0.001, 0.1, 10.0})
      for (const int count : {1, 16, 100}) {
        SCOPED_TRACE(std::to_string(mass) + " kg at " + std::to_string(count) + " nodes");
        run(mass, count);
      }
  }

  void clear(btSoftBody& cloth, btRigidBody& box) {
    anchored.clear();
    sim.remove(cloth);
    sim.remove(box);
  }

  struct Anchored {
    const btSoftBody::Node* node;
    const btRigidBody* rigid;
    btVector3 local;
  };
  std::vector<Anchored> anchored;
  Vector3 center = Vector3::Zero();
  const Vector3 half{0.08, 0.08, 0.08};  // its moments of inertia are equal: Bullet changes no spin

 private:
  int runs_ = 0;
};

TEST_P(ClothAnchors, ToAStaticBoxHold) {
  sim.set_gravity({0, -9.81, 0});
  for_all([&](Real mass, int count) {
    btSoftBody& cloth = add_cloth(mass, 1);
    btRigidBody& box = sim.add_box(half, 0, center + Vector3(0.03, -0.1, 0));
    anchor(cloth, box, count);
    EXPECT_LT(expect_no_energy(90), limit(1e-9, 1e-5));
    clear(cloth, box);
  });
}

TEST_P(ClothAnchors, ToAFreeBoxKeepMomentaAndEnergy) {
  for_all([&](Real mass, int count) {
    btSoftBody& cloth = add_cloth(mass, 1);
    btRigidBody& box = sim.add_box(half, 1, center + Vector3(0.03, -0.1, 0));
    box.setLinearVelocity(btVector3(btScalar(0.3), 0, 0));
    box.setAngularVelocity(btVector3(1, 2, 3));
    for (int i = 0; i < cloth.m_nodes.size(); ++i)
      cloth.m_nodes[i].m_v = btVector3(0, btScalar(0.5) * btScalar(i % 3 - 1), btScalar(0.5) * btScalar(i % 2));
    anchor(cloth, box, count);
    sim.penalty().synchronize(cloth);
    const Totals before = sim.totals();
    EXPECT_LT(expect_no_energy(90), 0.001);
    const Totals after = sim.totals();
    EXPECT_LT((after.momentum - before.momentum).norm(), limit(1e-13, 1e-5) * (1 + mass));
    EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), limit(1e-13, 1e-5) * (1 + mass));
    clear(cloth, box);
  });
}

TEST_P(ClothAnchors, ToAFreeBoxFallWithIt) {
  sim.set_gravity({0, -9.81, 0});
  for_all([&](Real mass, int count) {
    btSoftBody& cloth = add_cloth(mass, 1);
    btRigidBody& box = sim.add_box(half, 1, center + Vector3(0.03, -0.1, 0));
    box.setAngularVelocity(btVector3(1, 2, 3));
    anchor(cloth, box, count);
    const Vector3 before = sim.totals().momentum;
    EXPECT_LT(expect_no_energy(60), 0.001);
    EXPECT_LT((sim.totals().momentum - before - Vector3(0, -9.81 * 60 * frame * (1 + mass), 0)).norm(),
              limit(1e-5, 1e-3) * (1 + mass));
    clear(cloth, box);
  });
}

TEST_P(ClothAnchors, ToABoxOnTheGround) {
  // A box that heavy cloth throws about is where Bullet's own contacts leave it at the end of a step.
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  for_all([&](Real mass, int count) {
    if (mass > 1 && count < 100) return;
    btSoftBody& cloth = add_cloth(mass, 0.2);
    btRigidBody& box = sim.add_box(half, 1, {center.x() + 0.03, half.y(), center.z()});
    anchor(cloth, box, count);
    EXPECT_LT(expect_no_energy(90), 0.001);
    EXPECT_NEAR(Real(box.getWorldTransform().getOrigin().y()), half.y(), 0.002);
    clear(cloth, box);
  });
}

TEST_P(ClothAnchors, CarryABoxByClothThatIsHeldAtItsCorners) {
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& cloth = add_cloth(1, 1, 0.01);
  for (const int corner : {0, 10, 110, 120}) cloth.setMass(corner, 0);
  cloth.setTotalMass(btScalar(0.02));
  btRigidBody& box = sim.add_box(half, 1, center - Vector3(0, 0.1, 0));
  anchor(cloth, box, 16);
  EXPECT_LT(expect_no_energy(60), 0.001);
  EXPECT_GT(Real(box.getWorldTransform().getOrigin().y()), 0.5);
}

// Two boxes on a light node between them: a ball joint.
TEST_P(ClothAnchors, OfOneNodeAtTwoBoxesJointThem) {
  for (const Real mass : {0.001, 1.0}) {
    SCOPED_TRACE(mass);
    btSoftBody& cloth = add_cloth(mass, 1);
    btRigidBody& left = sim.add_box(half, 1, center + Vector3(-0.2, -0.3, 0));
    btRigidBody& right = sim.add_box(half, 1, center + Vector3(0.2, -0.3, 0));
    left.setAngularVelocity(btVector3(0, 3, 2));
    right.setLinearVelocity(btVector3(0, 0, 1));
    for (btRigidBody* box : {&left, &right}) anchor_node(cloth, 60, *box);
    const Totals before = sim.totals();
    EXPECT_LT(expect_no_energy(90), 0.001);
    EXPECT_LT((sim.totals().momentum - before.momentum).norm(), limit(1e-13, 1e-5));
    EXPECT_LT((sim.totals().angular_momentum - before.angular_momentum).norm(), limit(1e-13, 1e-5));
    sim.remove(right);
    clear(cloth, left);
  }
}

TEST_P(ClothAnchors, FollowAKinematicBodyFarAwayThatWakesThem) {
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& cloth = add_cloth(0.1, 1);
  btRigidBody& hand = sim.add_box(half, 0, center + Vector3(0, 8, 0));
  hand.setCollisionFlags(hand.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  hand.forceActivationState(DISABLE_DEACTIVATION);
  anchor(cloth, hand, 4);
  sim.step(frame, 5);
  let_sleep(cloth);
  cloth.forceActivationState(ISLAND_SLEEPING);
  sim.step(frame, 5);
  ASSERT_FALSE(cloth.isActive());
  for (int k = 1; k <= 30; ++k) {
    hand.setWorldTransform(
        btTransform(btQuaternion::getIdentity(), to_bullet(Vector3(center + Vector3(0, 8 + k * frame, 0)))));
    sim.step(frame);
  }
  EXPECT_TRUE(cloth.isActive());
  EXPECT_LT(gap(), 0.001);
}

TEST_P(ClothAnchors, LetClothAndBoxSleepAndWakeTogether) {
  sim.set_gravity({0, -9.81, 0});
  btSoftBody& cloth = add_cloth(0.1, 1, 0.05);
  for (const int corner : {0, 10, 110, 120}) cloth.setMass(corner, 0);
  btRigidBody& box = sim.add_box(half, 0.1, center - Vector3(0, 0.1, 0));
  box.setDamping(btScalar(0.5), btScalar(0.5));
  anchor(cloth, box, 16);
  let_sleep(cloth);
  let_sleep(box);
  for (int k = 0;
       k < 1800 && !(cloth.getActivationState() == ISLAND_SLEEPING && box.getActivationState() == ISLAND_SLEEPING); ++k)
    sim.step(frame);
  ASSERT_EQ(cloth.getActivationState(), ISLAND_SLEEPING);
  ASSERT_EQ(box.getActivationState(), ISLAND_SLEEPING);
  box.activate(true);
  box.setLinearVelocity(btVector3(0, 0, 1));
  sim.step(frame, 5);
  EXPECT_TRUE(cloth.isActive());
  EXPECT_LT(gap(), 0.001);
}

INSTANTIATE_TEST_SUITE_P(World, ClothAnchors, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
