// One 1/60 s world step of the beam that sags in gravity: the plugin in both worlds, beside Bullet's own implicit
// springs and Neo-Hookean forces on the same mesh. The argument is the number of cells across.
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <benchmark/benchmark.h>
#include <btBulletDynamicsCommon.h>

#include "penalty/bullet_penalty.h"
#include "reference_beam.h"

namespace {

using namespace penalty;

const btVector3 gravity(0, btScalar(-9.81), 0);

std::vector<int> clamped_nodes(const TetMesh& mesh) {
  std::vector<int> nodes;
  for (int i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.vertices(0, i) < 1e-9) nodes.push_back(i);
  return nodes;
}

std::unique_ptr<btSoftBody> beam_body(btSoftBodyWorldInfo& info, const TetMesh& mesh) {
  info.m_gravity = gravity;
  auto body = make_soft_body(info, mesh, {.mass = 4000, .pinned = clamped_nodes(mesh), .stock_deformable = true});
  body->setActivationState(DISABLE_DEACTIVATION);
  return body;
}

void classic(benchmark::State& state) {
  const TetMesh mesh = make_beam(static_cast<int>(state.range(0)));
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  PenaltySoftBodySolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  const auto body = beam_body(world.getWorldInfo(), mesh);
  world.addSoftBody(body.get());
  solver.attach(*body, reference_beam_field(mesh, static_cast<int>(state.range(0))), {.step = {.drag = 0.1}});
  for (auto _ : state) world.stepSimulation(btScalar(1) / 60, 0);
  state.counters["substeps"] = solver.report(*body).substeps;
  world.removeSoftBody(body.get());
}

void deformable(benchmark::State& state) {
  const TetMesh mesh = make_beam(static_cast<int>(state.range(0)));
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  PenaltyDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  constraints.setDeformableSolver(&solver);
  btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  const auto body = beam_body(world.getWorldInfo(), mesh);
  world.addSoftBody(body.get());
  solver.attach(*body, reference_beam_field(mesh, static_cast<int>(state.range(0))), {.step = {.drag = 0.1}});
  for (auto _ : state) world.stepSimulation(btScalar(1) / 60, 0);
  state.counters["substeps"] = solver.report(*body).substeps;
  world.removeSoftBody(body.get());
}

// Bullet's stock implicit solver with one of its own forces on links or tetrahedra of the same mesh.
void stock(benchmark::State& state, btDeformableLagrangianForce& force, bool with_tetrahedra) {
  const int cells = static_cast<int>(state.range(0));
  const TetMesh mesh = make_beam(cells);
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  constraints.setDeformableSolver(&solver);
  btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  world.setImplicit(true);
  world.setUseProjection(true);
  const auto body = beam_body(world.getWorldInfo(), mesh);
  if (with_tetrahedra) {
    for (const auto& [a, b, c, d] : mesh.tetrahedra) body->appendTetra(a, b, c, d);
    body->initializeDmInverse();
    body->m_tetraScratches.resizeNoInitialize(body->m_tetras.size());
    body->m_tetraScratchesTn.resizeNoInitialize(body->m_tetras.size());
  }
  world.addSoftBody(body.get());
  btDeformableGravityForce weight(gravity);
  world.addForce(body.get(), &weight);
  world.addForce(body.get(), &force);
  for (auto _ : state) world.stepSimulation(btScalar(1) / 60, 0);
  world.removeSoftBody(body.get());
}

void stock_mass_spring(benchmark::State& state) {
  btDeformableMassSpringForce force(static_cast<btScalar>(0.4 * 1e7 / static_cast<double>(state.range(0))), 0, false);
  stock(state, force, false);
}

void stock_neo_hookean(benchmark::State& state) {
  btDeformableNeoHookeanForce force(btScalar(4e6), btScalar(4e6), 0);
  stock(state, force, true);
}

BENCHMARK(classic)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(60);
BENCHMARK(deformable)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(60);
BENCHMARK(stock_mass_spring)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(60);
BENCHMARK(stock_neo_hookean)->Arg(4)->Arg(8)->Unit(benchmark::kMillisecond)->Iterations(60);

}  // namespace

BENCHMARK_MAIN();
