// Bullet's settings of a soft body, beside stock Bullet and without it.
#include "simulation.h"

namespace penalty::testing {
namespace {

class BodySettings : public ::testing::TestWithParam<WorldKind> {};
INSTANTIATE_TEST_SUITE_P(World, BodySettings, ::testing::Values(WorldKind::classic, WorldKind::deformable),
                         [](const auto& param) { return world_name(param.param); });

constexpr int frames = 20;
using Set = void (*)(btSoftBody&);

// Particles that nothing holds together: how far what `set` asks for moves them.
std::vector<Vector3> moved_by(WorldKind kind, Solver solver, Set set) {
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
  for (int k = 0; k < frames; ++k) sim.step(1.0 / 60);
  for (int i = 0; i < body.m_nodes.size(); ++i) moved.push_back(to_vector(body.m_nodes[i].m_x) - unmoved[i]);
  return moved;
}

// Bullet's classic world is the reference for both: its deformable one has no such forces.
void expect_as_in_bullet(WorldKind kind, Set set, Real least) {
  const std::vector<Vector3> stock = moved_by(WorldKind::classic, Solver::bullet, set),
                             ours = moved_by(kind, Solver::penalty, set);
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
