// What Bullet does without the plugin, and that the plugin leaves it alone for bodies that are not attached.
#include "bullet/simulation.h"

#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <limits>

#include "penalty/fields/elastic_field.h"

namespace penalty::testing {
namespace {

class Squashed : public WorldTest {
 protected:
  // A box of Bullet's own tetrahedra, of full volume stiffness, squashed to a fifth of its height.
  btSoftBody& add_squashed_box(Simulation& simulation, const TetMesh& box) {
    auto made = make_soft_body(simulation.info(), box);
    for (const Tetrahedron& t : box.tetrahedra) made->appendTetra(t[0], t[1], t[2], t[3]);
    made->m_materials[0]->m_kVST = 1;
    btSoftBody& body = simulation.add(std::move(made));
    simulation.step(frame);  // Bullet takes its rest volumes from the first step
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_x.setY(node.m_x.y() / 5);
      node.m_q = node.m_x;
    }
    return body;
  }

  static Real height(const btSoftBody& body) {
    Real low = 1e9, high = -1e9;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      low = std::min(low, Real(body.m_nodes[i].m_x.y()));
      high = std::max(high, Real(body.m_nodes[i].m_x.y()));
    }
    return high - low;
  }

  const TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
};

TEST_P(Squashed, ABodyOfBulletsTetrahedraStaysFlat) {
  Simulation bullet(GetParam(), Solver::bullet);
  const btSoftBody& body = add_squashed_box(bullet, mesh);
  bullet.step(frame, 120);
  EXPECT_NEAR(height(body), 0.2, 1e-6);
}

TEST_P(Squashed, TheSameBodyAttachedRecovers) {
  btSoftBody& body = add_squashed_box(sim, mesh);
  sim.penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, 10.0),
                       {.step = {.damping_time = 0.01}});
  EXPECT_NEAR(height(body), 0.2, 1e-6);
  sim.step(frame, 120);
  EXPECT_NEAR(height(body), 1, 0.02);
  EXPECT_LT(mean_volume_error(sim.penalty(), body), 0.01);
}

// The deformable world reads arrays that only its own loaders fill when a body holds tetrahedra.
INSTANTIATE_TEST_SUITE_P(World, Squashed, classic_world(), param_name);

// Vertices anywhere in the bounding box: what the plugin finds back from, Bullet's own soft bodies do not.
class Scrambled : public ::testing::TestWithParam<WorldKind> {
 protected:
  const TetMesh mesh = make_box({1, 1, 1}, {3, 3, 3});
  const std::vector<Edge> edges = edges_of(mesh.tetrahedra);

  void scramble(btSoftBody& body) const {
    Random random(1);
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_x = to_bullet(Vector3(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)));
      node.m_q = node.m_x;
    }
  }

  // Mean |L / L0 - 1| of the edges; infinite if the body has burst.
  Real length_error(const btSoftBody& body) const {
    Real sum = 0;
    for (const auto& [a, b] : edges) {
      const Real rest = (mesh.vertices.col(a) - mesh.vertices.col(b)).norm();
      const Real length = (to_vector(body.m_nodes[a].m_x) - to_vector(body.m_nodes[b].m_x)).norm();
      if (!(length < 100)) return std::numeric_limits<Real>::infinity();
      sum += std::abs(length / rest - 1) / static_cast<Real>(edges.size());
    }
    return sum;
  }

  // After five seconds, or where it burst: Bullet does not survive numbers that are not finite.
  Real length_error_after_five_seconds(Simulation& simulation, const btSoftBody& body) const {
    Real error = length_error(body);
    for (int step = 0; step < 300 && std::isfinite(error); ++step) {
      simulation.step(frame);
      error = length_error(body);
    }
    return error;
  }
};

class ScrambledClassic : public Scrambled {};

TEST_P(ScrambledClassic, BulletsLinksVolumeAndPoseDoNotFindBack) {
  Simulation bullet(GetParam(), Solver::bullet);
  btSoftBody& body = bullet.add(make_soft_body(bullet.info(), mesh));
  for (const auto& [a, b] : edges) body.appendLink(a, b);
  body.m_cfg.kVC = 20;
  body.m_cfg.kMT = btScalar(0.05);
  body.m_cfg.piterations = 10;
  body.setPose(true, true);
  scramble(body);
  ASSERT_GT(length_error(body), 0.5);
  EXPECT_GT(length_error_after_five_seconds(bullet, body), 0.1);
}

INSTANTIATE_TEST_SUITE_P(World, ScrambledClassic, classic_world(), param_name);

class ScrambledDeformable : public Scrambled {};

TEST_P(ScrambledDeformable, BulletsNeoHookeanForceDoesNotFindBack) {
  btDeformableNeoHookeanForce force(btScalar(4e4), btScalar(4e4), btScalar(0.01));  // outlives its world
  Simulation bullet(GetParam(), Solver::bullet);
  auto made = make_soft_body(bullet.info(), mesh, {.stock_deformable = true});
  for (const Tetrahedron& t : mesh.tetrahedra) made->appendTetra(t[0], t[1], t[2], t[3]);
  made->initializeDmInverse();
  made->m_tetraScratches.resize(made->m_tetras.size());
  made->m_tetraScratchesTn.resize(made->m_tetras.size());
  btSoftBody& body = bullet.add(std::move(made));
  bullet.deformable_world().addForce(&body, &force);
  scramble(body);
  EXPECT_GT(length_error_after_five_seconds(bullet, body), 0.1);
}

INSTANTIATE_TEST_SUITE_P(World, ScrambledDeformable, deformable_world(), param_name);

TEST_P(Scrambled, TheSameBodyAttachedFindsBack) {
  Simulation sim(GetParam());
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh));
  sim.penalty().attach(body, make_recovering_field(mesh.vertices, mesh.tetrahedra, {.young = 1e3, .poisson = 0.35}),
                       {.step = {.integrator = Integrator::implicit_step, .damping_time = 0.005}});
  scramble(body);
  ASSERT_GT(length_error(body), 0.5);
  EXPECT_LT(length_error_after_five_seconds(sim, body), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(World, Scrambled, both_worlds(), param_name);

class BesideOurs : public ::testing::TestWithParam<WorldKind> {
 protected:
  // A cloth of links, two corners pinned, that swings against a box. Its forces outlive the world.
  struct Cloth {
    void hang_in(Simulation& simulation, WorldKind kind) {
      simulation.set_gravity({0, -9.75, 0});
      simulation.add_box({0.3, 0.3, 0.3}, 0, {0, -0.4, 0.3});
      std::unique_ptr<btSoftBody> made(btSoftBodyHelpers::CreatePatch(simulation.info(), btVector3(-1, 0, -1),
                                                                      btVector3(1, 0, -1), btVector3(-1, 0, 1),
                                                                      btVector3(1, 0, 1), 9, 9, 3, true));
      made->getCollisionShape()->setMargin(btScalar(0.05));
      const bool deformable = kind == WorldKind::deformable;
      if (deformable) made->m_cfg.collisions = btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN;
      body = &simulation.add(std::move(made));
      if (deformable) {
        simulation.deformable_world().addForce(body, &springs);
        simulation.deformable_world().addForce(body, &gravity);
      }
    }

    btDeformableMassSpringForce springs{20, btScalar(0.1), false};
    btDeformableGravityForce gravity{btVector3(0, btScalar(-9.75), 0)};
    btSoftBody* body = nullptr;
  };
};

TEST_P(BesideOurs, ABodyOfBulletsMovesAsInAWorldWithoutThePlugin) {
  Cloth alone, mixed;
  Simulation bullet(GetParam(), Solver::bullet), both(GetParam());
  alone.hang_in(bullet, GetParam());
  mixed.hang_in(both, GetParam());
  btSoftBody& ours = both.add_jelly(make_ball(0.3, 2), {.shift = {20, 5, 0}});
  for (int step = 0; step < 60; ++step) {
    bullet.step(1.0 / 64);
    both.step(1.0 / 64);
    for (int i = 0; i < alone.body->m_nodes.size(); ++i)
      ASSERT_EQ((alone.body->m_nodes[i].m_x - mixed.body->m_nodes[i].m_x).length(), 0)
          << "step " << step << ", node " << i;
  }
  EXPECT_LT(lowest(*mixed.body), -0.3) << "the cloth hangs";
  EXPECT_NEAR(center_of_mass(both.penalty().particles(ours)).y(), 5 - 9.75 * 60 * 60 / 64 / 64 / 2, 1e-5);
}

TEST_P(BesideOurs, OursMovesAsWithoutTheOther) {
  Cloth other;
  Simulation both(GetParam()), lonely(GetParam());
  lonely.set_gravity({0, -9.75, 0});
  other.hang_in(both, GetParam());
  btSoftBody& here = both.add_jelly(make_ball(0.3, 2), {.shift = {20, 5, 0}});
  btSoftBody& there = lonely.add_jelly(make_ball(0.3, 2), {.shift = {20, 5, 0}});
  for (btSoftBody* body : {&here, &there}) body->m_nodes[1].m_v = btVector3(1, 2, 3);
  both.step(1.0 / 64, 60);
  lonely.step(1.0 / 64, 60);
  EXPECT_EQ(both.penalty().particles(here).positions, lonely.penalty().particles(there).positions);
}

INSTANTIATE_TEST_SUITE_P(World, BesideOurs, both_worlds(), param_name);

class ImplicitWorld : public WorldTest {};

TEST_P(ImplicitWorld, IsTheSameForWorldsOfAttachedBodiesOnly) {
  Simulation implicit(GetParam());
  implicit.deformable_world().setImplicit(true);
  std::vector<btSoftBody*> bodies;
  for (Simulation* s : {&sim, &implicit}) {
    s->set_gravity({0, -9.75, 0});
    s->add_ground();
    bodies.push_back(
        &s->add_jelly(make_ball(0.3, 2), {.shift = {0, 0.5, 0}, .attach = {.step = {.damping_time = 0.002}}}));
    s->add_box({0.1, 0.1, 0.1}, 0.3, {0.05, 1.1, 0});
  }
  for (int step = 0; step < 90; ++step) {
    sim.step(1.0 / 64);
    implicit.step(1.0 / 64);
    ASSERT_EQ(sim.penalty().particles(*bodies[0]).positions, implicit.penalty().particles(*bodies[1]).positions)
        << step;
    ASSERT_EQ(sim.penalty().particles(*bodies[0]).velocities, implicit.penalty().particles(*bodies[1]).velocities)
        << step;
  }
}

INSTANTIATE_TEST_SUITE_P(World, ImplicitWorld, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
