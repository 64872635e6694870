// Pinned nodes that an application moves by writing where they are to be: they go there through the step.
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <limits>

#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

/// A cape: cloth of 1 x 1.5 m that hangs by its upper row.
class MovedPins : public WorldTest {
 protected:
  void SetUp() override {
    sim.set_gravity({0, -9.75, 0});
    const Real top = cloth.vertices.row(1).maxCoeff();
    for (int i = 0; i < cloth.vertices.cols(); ++i)
      if (cloth.vertices(1, i) > top - 1e-9) pinned.push_back(i);
  }

  btSoftBody& add_cape(Simulation& home) {
    btSoftBody& cape = home.add(make_soft_body(home.info(), cloth, {.mass = 0.45, .pinned = pinned}));
    PotentialField field(cloth.vertices);
    field.add<Length>(edges_of(cloth.triangles), 30);
    home.penalty().attach(cape, std::move(field), {.step = {.damping_time = 0.005}, .self_contact = false});
    return cape;
  }

  void move_pins(btSoftBody& cape, const Vector3& shift) const {
    for (const int i : pinned) cape.m_nodes[i].m_x = to_bullet(Vector3(cloth.vertices.col(i) + shift));
  }

  // Their velocity leads there, too, as long as it is said anew in every step.
  void drive_pins(btSoftBody& cape, const Vector3& shift) const {
    for (const int i : pinned)
      cape.m_nodes[i].m_v =
          to_bullet(Vector3((cloth.vertices.col(i) + shift - to_vector(cape.m_nodes[i].m_x)) / exact_frame));
  }

  Real longest_edge(const btSoftBody& cape) const {
    Real longest = 0;
    for (const auto& [a, b] : edges_of(cloth.triangles))
      longest = std::max(longest, Real(cape.m_nodes[a].m_x.distance(cape.m_nodes[b].m_x)) /
                                      (cloth.vertices.col(a) - cloth.vertices.col(b)).norm());
    return longest;
  }

  const TriangleSurface cloth = make_sheet(1, 1.5, 20, 20);
  std::vector<int> pinned;
};

TEST_P(MovedPins, ArriveExactlyAndStayThere) {
  btSoftBody& cape = add_cape(sim);
  for (const Real x : {0.03125, 0.0625, 0.0625, 0.7}) {
    move_pins(cape, {x, 0, x / 3});
    const btVector3 wanted = cape.m_nodes[pinned[3]].m_x;
    for (int k = 0; k < 3; ++k) {
      sim.step(exact_frame);
      ASSERT_EQ(cape.m_nodes[pinned[3]].m_x, wanted);
      ASSERT_EQ(cape.m_nodes[pinned[3]].m_v, btVector3(0, 0, 0));
      ASSERT_EQ(sim.penalty().particles(cape).velocities.col(pinned[3]).norm(), 0);
    }
  }
}

// From rest to full speed in half a second, then round in a circle.
TEST_P(MovedPins, OfACapeStretchItNoMoreThanPinsThatAreDriven) {
  for (const Real speed : {5, 30}) {
    const Real radius = speed > 10 ? 20 : 2, straight = speed / 4;
    const auto place = [&](Real t) -> Vector3 {
      const Real way = t < 0.5 ? speed * t * t : straight + speed * (t - 0.5);
      if (way < straight) return {way, 0, 0};
      const Real angle = (way - straight) / radius;
      return {straight + radius * std::sin(angle), 0, radius * (1 - std::cos(angle))};
    };
    Simulation other(GetParam());
    other.set_gravity({0, -9.75, 0});
    btSoftBody &moved = add_cape(sim), &driven = add_cape(other);
    Real longest_moved = 0, longest_driven = 0;
    int substeps_moved = 0, substeps_driven = 0;
    for (int k = 1; k <= 80; ++k) {
      move_pins(moved, place(k * exact_frame));
      drive_pins(driven, place(k * exact_frame));
      sim.step(exact_frame);
      other.step(exact_frame);
      longest_moved = std::max(longest_moved, longest_edge(moved));
      longest_driven = std::max(longest_driven, longest_edge(driven));
      substeps_moved = std::max(substeps_moved, sim.penalty().report(moved).substeps);
      substeps_driven = std::max(substeps_driven, other.penalty().report(driven).substeps);
      ASSERT_EQ(sim.penalty().report(moved).retries, 0) << "frame " << k;
    }
    RecordProperty("longest_moved_" + std::to_string(int(speed)), std::to_string(longest_moved));
    RecordProperty("longest_driven_" + std::to_string(int(speed)), std::to_string(longest_driven));
    EXPECT_NEAR(longest_moved, longest_driven, 0.05 * longest_driven) << speed;
    EXPECT_LT(longest_moved, 1.5) << speed;
    EXPECT_LE(substeps_moved, 2 * substeps_driven) << speed;
    sim.remove(moved);
  }
}

TEST_P(MovedPins, ArePaidForByWhoMovesThem) {
  // Energy at the end is that of the start and what flowed in, to the order of the step.
  btSoftBody& cape = add_cape(sim);
  const Real start = sim.totals().energy;
  for (int k = 1; k <= 64; ++k) {
    move_pins(cape, {0, k / 64.0, 0});
    sim.step(exact_frame);
  }
  const EnergyFlows flows = sim.penalty().flows(cape);
  EXPECT_GT(flows.driving, 0.45 * 9.75) << "lifted by a metre";
  EXPECT_NEAR(sim.totals().energy - start, flows.driving - flows.lost(), 0.02 * flows.driving);
}

TEST_P(MovedPins, PushABoxAtTheirSpeed) {
  sim.set_gravity({0, 0, 0});
  const TetMesh block = make_box({1, 0.5, 1}, {4, 2, 4});
  JellyOptions options;
  for (int i = 0; i < block.vertices.cols(); ++i)
    if (block.vertices(1, i) > 0.1) options.body.pinned.push_back(i);
  btSoftBody& body = sim.add_jelly(block, options);
  const btRigidBody& box = sim.add_box({0.2, 0.2, 0.4}, 50, {-0.3, 0.35, 0.5});
  for (int k = 1; k <= 32; ++k) {
    for (const int i : options.body.pinned)
      body.m_nodes[i].m_x = to_bullet(Vector3(block.vertices.col(i) - Vector3(2 * k * exact_frame, 0, 0)));
    sim.step(exact_frame);
  }
  EXPECT_NEAR(Real(box.getLinearVelocity().x()), -2, 0.05);
}

TEST_P(MovedPins, OfABodyThatIsTranslatedJumpWithIt) {
  btSoftBody& cape = add_cape(sim);
  sim.step(exact_frame, 32);
  const Real before = longest_edge(cape);
  cape.translate(btVector3(100, 3, -20));
  sim.step(exact_frame);
  EXPECT_LT(longest_edge(cape), before + 0.05);
  EXPECT_LT(sim.penalty().particles(cape).velocities.colwise().norm().maxCoeff(), 5);
  EXPECT_NEAR(sim.penalty().flows(cape).driving, 0, 1e-12);
}

TEST_P(MovedPins, OfABodyThatIsHeldAltogetherJump) {
  JellyOptions options;
  const TetMesh block = make_box({1, 0.5, 1}, {2, 1, 2});
  for (int i = 0; i < block.vertices.cols(); ++i) options.body.pinned.push_back(i);
  btSoftBody& body = sim.add_jelly(block, options);
  btRigidBody& box = sim.add_box({0.2, 0.2, 0.2}, 1, {5, 0.25, 0.5});
  box.setGravity(btVector3(0, 0, 0));
  body.translate(btVector3(10, 0, 0));
  sim.step(exact_frame);
  EXPECT_NEAR(Real(body.m_nodes[0].m_x.x()), 10, 1e-6);
  EXPECT_LT(Real(box.getLinearVelocity().length()), 1e-6) << "was in the way";
}

TEST_P(MovedPins, JumpIfTheyAreSynchronized) {
  btSoftBody& cape = add_cape(sim);
  sim.step(exact_frame);
  move_pins(cape, {0.25, 0, 0});
  sim.penalty().synchronize(cape);
  EXPECT_EQ(sim.penalty().particles(cape).positions(0, pinned[0]), cloth.vertices(0, pinned[0]) + 0.25);
  sim.step(exact_frame);
  EXPECT_EQ(sim.penalty().flows(cape).driving, 0);
}

TEST_P(MovedPins, HaveTheVelocityThatTheyWereGivenAgainWhenTheyAreThere) {
  btSoftBody& cape = add_cape(sim);
  const int pin = pinned[3];
  const Vector3 start = to_vector(cape.m_nodes[pin].m_x);
  cape.m_nodes[pin].m_x += btVector3(btScalar(0.015625), 0, 0);
  cape.m_nodes[pin].m_v = btVector3(0, 0, 1);
  sim.step(exact_frame);
  EXPECT_LT((to_vector(cape.m_nodes[pin].m_x) - start - Vector3(0.015625, 0, 0)).norm(), 1e-6);
  EXPECT_EQ(cape.m_nodes[pin].m_v, btVector3(0, 0, 1));
  sim.step(exact_frame);
  EXPECT_LT((to_vector(cape.m_nodes[pin].m_x) - start - Vector3(0.015625, 0, exact_frame)).norm(), 1e-6);
}

TEST_P(MovedPins, ThatWereJustPinnedDoNotFlyOn) {
  btSoftBody& cape = add_cape(sim);
  cape.addVelocity(btVector3(btScalar(0.5), 0, 1));
  sim.step(exact_frame, 2);
  int picked = 0;
  for (int i = 0; i < cape.m_nodes.size(); ++i)
    if (cape.m_nodes[i].m_v.length() > cape.m_nodes[picked].m_v.length()) picked = i;
  ASSERT_GT(Real(cape.m_nodes[picked].m_v.length()), 0.01);
  cape.setMass(picked, 0);
  const btVector3 hand = cape.m_nodes[picked].m_x + btVector3(0, btScalar(0.01), 0);
  for (int k = 0; k < 5; ++k) {
    cape.m_nodes[picked].m_x = hand;
    sim.step(exact_frame);
    ASSERT_EQ(cape.m_nodes[picked].m_x, hand);
    ASSERT_EQ(cape.m_nodes[picked].m_v, btVector3(0, 0, 0));
  }
}

TEST_P(MovedPins, WakeABodyThatSleeps) {
  btSoftBody& cape = add_cape(sim);
  sim.step(exact_frame, 8);
  let_sleep(cape);
  cape.forceActivationState(ISLAND_SLEEPING);
  sim.step(exact_frame, 2);
  ASSERT_FALSE(cape.isActive());
  const Real before = lowest(cape);
  move_pins(cape, {0, 0.5, 0});
  sim.step(exact_frame, 16);
  EXPECT_TRUE(cape.isActive());
  EXPECT_GT(lowest(cape), before + 0.1);
}

TEST_P(MovedPins, OfABodyThatCannotBeSteppedAreWhereTheyWerePut) {
  btSoftBody& cape = add_cape(sim);
  sim.step(exact_frame, 4);
  const btScalar lift = cape.m_cfg.kLF;
  cape.m_cfg.kLF = std::numeric_limits<btScalar>::quiet_NaN();
  move_pins(cape, {0.1, 0, 0});
  const btVector3 wanted = cape.m_nodes[pinned[3]].m_x;
  sim.step(exact_frame, 2);
  ASSERT_FALSE(sim.penalty().report(cape).problem.empty());
  EXPECT_EQ(cape.m_nodes[pinned[3]].m_x, wanted);
  cape.m_cfg.kLF = lift;
  sim.step(exact_frame, 2);
  EXPECT_TRUE(sim.penalty().report(cape).problem.empty());
  EXPECT_EQ(cape.m_nodes[pinned[3]].m_x, wanted);
  EXPECT_EQ(cape.m_nodes[pinned[3]].m_v, btVector3(0, 0, 0));
}

INSTANTIATE_TEST_SUITE_P(World, MovedPins, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
