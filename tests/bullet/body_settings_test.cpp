// Bullet's settings of a soft body, beside stock Bullet and without it.
#include <array>
#include <cmath>

#include "simulation.h"

namespace penalty::testing {
namespace {

class BodySettings : public ::testing::TestWithParam<WorldKind> {};
INSTANTIATE_TEST_SUITE_P(World, BodySettings, ::testing::Values(WorldKind::classic, WorldKind::deformable),
                         [](const auto& param) { return world_name(param.param); });

constexpr int frames = 20;
using Set = void (*)(btSoftBody&);

// Particles that nothing holds together: how far what `set` asks for moves them, and what `each` does before each step.
std::vector<Vector3> moved_by(WorldKind kind, Solver solver, Set set, Set each) {
  const TetMesh ball = make_ball(0.5, 4);
  Simulation sim(kind, solver);
  sim.set_gravity({0, 0, 0});
  sim.info().air_density = btScalar(1.2);
  auto made = make_soft_body(sim.info(), ball, {.mass = 2});
  btSoftBody& body = sim.add(std::move(made));
  set(body);
  if (solver == Solver::penalty) sim.penalty().attach(body, PotentialField(ball.vertices));
  std::vector<Vector3> unmoved, moved;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    unmoved.push_back(to_vector(body.m_nodes[i].m_x) + frames / 60.0 * to_vector(body.m_nodes[i].m_v));
  for (int k = 0; k < frames; ++k) {
    if (each) each(body);
    sim.step(1.0 / 60);
  }
  for (int i = 0; i < body.m_nodes.size(); ++i) moved.push_back(to_vector(body.m_nodes[i].m_x) - unmoved[i]);
  return moved;
}

// Bullet's classic world is the reference for both: its deformable one has no such forces.
void expect_as_in_bullet(WorldKind kind, Set set, Real least, Set each = nullptr) {
  const std::vector<Vector3> stock = moved_by(WorldKind::classic, Solver::bullet, set, each),
                             ours = moved_by(kind, Solver::penalty, set, each);
  Real farthest = 0, off = 0;
  for (std::size_t i = 0; i < stock.size(); ++i) {
    farthest = std::max(farthest, stock[i].norm());
    off = std::max(off, (ours[i] - stock[i]).norm());
  }
  EXPECT_GT(farthest, least);
  EXPECT_LT(off, 0.1 * farthest);  // Bullet drifts after it kicks: 1 / frames further
}

// Bullet's wind takes from nodes at most the speed that they have: it moves none that is at rest.
template <btSoftBody::eAeroModel::_ model>
void blow(btSoftBody& body) {
  body.m_cfg.aeromodel = model;
  body.m_cfg.kDG = btScalar(0.5);
  body.m_cfg.kLF = btScalar(0.1);
  body.setWindVelocity(btVector3(0, 1, 8));
  body.setVelocity(btVector3(1, 2, 4));
}

TEST_P(BodySettings, WindDragsAndLiftsTheNodesAsInBullet) {
  expect_as_in_bullet(GetParam(), blow<btSoftBody::eAeroModel::V_TwoSided>, 0.05);
}

TEST_P(BodySettings, WindDragsAndLiftsTheFacesAsInBullet) {
  expect_as_in_bullet(GetParam(), blow<btSoftBody::eAeroModel::F_TwoSided>, 0.05);
}

TEST_P(BodySettings, PressureBlowsABodyUpAsInBullet) {
  expect_as_in_bullet(GetParam(), [](btSoftBody& body) { body.m_cfg.kPR = btScalar(0.5); }, 0.05);
}

TEST_P(BodySettings, VolumeIsKeptAsInBullet) {
  expect_as_in_bullet(
      GetParam(),
      [](btSoftBody& body) {
        body.setPose(true, false);
        body.m_cfg.kVC = 2;
        body.scale(btVector3(btScalar(1.3), btScalar(1.3), btScalar(1.3)));
      },
      0.05);
}

TEST_P(BodySettings, WhatIsAddedInEachStepActsAsInBullet) {
  const auto set_nothing = [](btSoftBody&) {};
  const auto push = [](btSoftBody& body) { body.addForce(btVector3(0, 30, 10)); };
  expect_as_in_bullet(GetParam(), set_nothing, 0.05, push);
  expect_as_in_bullet(GetParam(), [](btSoftBody& body) { body.setTotalMass(20); }, 0.02, push);
  expect_as_in_bullet(GetParam(), set_nothing, 0.05,
                      [](btSoftBody& body) { body.addVelocity(btVector3(0, 0, btScalar(0.1))); });
  expect_as_in_bullet(
      GetParam(),
      [](btSoftBody& body) {
        body.m_cfg.aeromodel = btSoftBody::eAeroModel::V_TwoSided;
        body.setVelocity(btVector3(1, 2, 4));
      },
      0.01,
      [](btSoftBody& body) {
        body.m_cfg.kDG = btScalar(0.5);  // for this call alone
        for (int i = 0; i < body.m_nodes.size(); ++i) body.addAeroForceToNode(btVector3(0, 0, 8), i);
        body.m_cfg.kDG = 0;
      });
}

// The classic world has kDP, the deformable one drag; the other does nothing, there as here.
TEST_P(BodySettings, DampingTakesItsShareOfTheVelocityAsInBullet) {
  const bool is_classic = GetParam() == WorldKind::classic;
  const auto run = [&](Solver solver, Real damping, Real drag) {
    const TetMesh ball = make_ball(0.5, 2);
    Simulation sim(GetParam(), solver);
    sim.set_gravity({0, -8, 0});
    btSoftBody& body = sim.add(
        make_soft_body(sim.info(), ball, {.mass = 2, .stock_deformable = !is_classic && solver == Solver::bullet}));
    body.m_cfg.kDP = static_cast<btScalar>(damping);
    body.m_cfg.drag = static_cast<btScalar>(drag);
    body.setVelocity(btVector3(6, 0, 0));
    if (solver == Solver::penalty) sim.penalty().attach(body, PotentialField(ball.vertices));
    const Real start = Real(body.m_nodes[3].m_x.x());
    sim.step(1.0 / 60, 60);
    return std::array{Real(body.m_nodes[3].m_v.x()), Real(body.m_nodes[3].m_x.x()) - start};
  };
  const auto stock = run(Solver::bullet, 0.05, 0.05), ours = run(Solver::penalty, 0.05, 0.05);
  EXPECT_NEAR(ours[0], 6 * std::pow(0.95, 60), 1e-3);
  EXPECT_NEAR(ours[0], stock[0], 0.01 * stock[0]);
  EXPECT_NEAR(ours[1], stock[1], 0.1 * stock[1]);
  const auto other = run(Solver::penalty, is_classic ? 0 : 0.05, is_classic ? 0.05 : 0);
  EXPECT_NEAR(other[0], 6, 1e-5);
}

// One at a time: each is named once, by its own name, and changes nothing to the last bit.
TEST_P(BodySettings, EachThatDoesNothingIsNamedAndDoesNothing) {
  struct Setting {
    const char* name;
    Set set;
  };
  const Setting settings[] = {
      {"m_cfg.kMT is ", [](btSoftBody& b) { b.m_cfg.kMT = btScalar(0.5); }},
      {"m_cfg.timescale is ", [](btSoftBody& b) { b.m_cfg.timescale = 2; }},
      {"m_cfg.kVCF is ", [](btSoftBody& b) { b.m_cfg.kVCF = btScalar(0.5); }},
      {"m_cfg.kCHR is ", [](btSoftBody& b) { b.m_cfg.kCHR = btScalar(0.5); }},
      {"m_cfg.kKHR is ", [](btSoftBody& b) { b.m_cfg.kKHR = btScalar(0.5); }},
      {"m_cfg.kSHR is ", [](btSoftBody& b) { b.m_cfg.kSHR = btScalar(0.5); }},
      {"m_cfg.kAHR is ", [](btSoftBody& b) { b.m_cfg.kAHR = btScalar(0.5); }},
      {"m_cfg.m_maxStress is ", [](btSoftBody& b) { b.m_cfg.m_maxStress = 1; }},
      {"the rest length scale is ", [](btSoftBody& b) { b.setRestLengthScale(btScalar(0.5)); }},
      {"m_dampingCoefficient is ", [](btSoftBody& b) { b.setDampingCoefficient(btScalar(0.5)); }},
      {"m_repulsionStiffness is ", [](btSoftBody& b) { b.m_repulsionStiffness = 1; }},
      {"clusters do nothing", [](btSoftBody& b) { b.generateClusters(2); }},
  };
  const TetMesh box = make_box({1, 1, 1}, {2, 2, 2});
  const auto run = [&](Set set, std::vector<std::string>& unused) {
    Simulation sim(GetParam());
    sim.set_gravity({0, -9.81, 0});
    sim.add_ground();
    btSoftBody& body = sim.add(make_soft_body(sim.info(), moved(box, {0, 0.3, 0})));
    if (set) set(body);
    const AttachedBody attached = sim.penalty().attach(body, make_elastic_field(box.vertices, box.tetrahedra, 100.0));
    for (int k = 0; k < 60; ++k) sim.step(1.0 / 60);
    unused = attached.unused_settings();
    return PackedVectors(sim.penalty().particles(body).positions);
  };
  std::vector<std::string> unused;
  const PackedVectors reference = run(nullptr, unused);
  EXPECT_TRUE(unused.empty()) << "after a second in the world: " << unused.front();
  for (const Setting& setting : settings) {
    const PackedVectors positions = run(setting.set, unused);
    ASSERT_EQ(unused.size(), 1u) << setting.name;
    EXPECT_EQ(unused[0].find(setting.name), 0u) << unused[0];
    EXPECT_EQ(positions, reference) << setting.name;
  }
}

TEST_P(BodySettings, WhatDoesNothingIsNamedByAttach) {
  const TetMesh box = make_box({1, 1, 1}, {2, 2, 2});
  Simulation sim(GetParam());
  btSoftBody& body = sim.add(make_soft_body(sim.info(), box));
  EXPECT_TRUE(sim.penalty().attach(body, PotentialField(box.vertices)).unused_settings().empty());
  body.m_cfg.kMT = btScalar(0.25);
  body.m_cfg.timescale = btScalar(0.5);
  body.m_cfg.kCHR = btScalar(0.5);
  body.setDampingCoefficient(btScalar(0.1));
  const auto unused = sim.penalty().attach(body, PotentialField(box.vertices)).unused_settings();
  ASSERT_EQ(unused.size(), 4u);
  EXPECT_EQ(unused[0], "m_cfg.kMT is 0.25 and does nothing: for pose matching add a ShapeMatch to the field");
}

}  // namespace
}  // namespace penalty::testing
