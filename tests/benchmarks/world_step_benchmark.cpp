// One 1/60 s world step of the beam that sags in gravity: the plugin in both worlds, beside Bullet's own implicit
// springs and Neo-Hookean forces on the same mesh. The argument is the number of cells across.
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <benchmark/benchmark.h>

#include "penalty/bullet_penalty.h"
#include "reference_beam.h"
#include "scenes/bullet_world.h"

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

void step_beam(benchmark::State& state, demo::WorldKind kind) {
  const int cells = static_cast<int>(state.range(0));
  const TetMesh mesh = make_beam(cells);
  demo::BulletWorld world(kind);
  const auto body = beam_body(world.info(), mesh);
  world.add(*body);
  world.attached().attach(*body, reference_beam_field(mesh, cells), {.step = {.drag = 0.1}});
  for (auto _ : state) world.step(1.0 / 60);
  state.counters["substeps"] = world.attached().report(*body).substeps;
  world.remove(*body);
}

void classic(benchmark::State& state) { step_beam(state, demo::WorldKind::classic); }
void deformable(benchmark::State& state) { step_beam(state, demo::WorldKind::deformable); }

// Bullet's stock implicit solver with one of its own forces on links or tetrahedra of the same mesh.
void stock(benchmark::State& state, btDeformableLagrangianForce& force, bool with_tetrahedra) {
  const int cells = static_cast<int>(state.range(0));
  const TetMesh mesh = make_beam(cells);
  demo::BulletWorld world(demo::WorldKind::deformable, demo::SoftSolver::bullet);
  world.deformable().setImplicit(true);
  world.deformable().setUseProjection(true);
  const auto body = beam_body(world.info(), mesh);
  if (with_tetrahedra) {
    for (const auto& [a, b, c, d] : mesh.tetrahedra) body->appendTetra(a, b, c, d);
    body->initializeDmInverse();
    body->m_tetraScratches.resizeNoInitialize(body->m_tetras.size());
    body->m_tetraScratchesTn.resizeNoInitialize(body->m_tetras.size());
  }
  world.add(*body);
  btDeformableGravityForce weight(gravity);
  world.deformable().addForce(body.get(), &weight);
  world.deformable().addForce(body.get(), &force);
  for (auto _ : state) world.step(1.0 / 60);
  world.remove(*body);
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
