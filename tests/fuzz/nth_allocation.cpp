// The n-th allocation fails, for every n, in every call of the library.
//
//   nth_allocation [--most N] [--stride N]
//
// Out of a call comes std::bad_alloc; out of a step comes nothing. Afterwards bodies are where they were (after a step:
// or where it should have taken them), the next steps are finite, nodes are where particles are, and nothing is leaked.
// `--most` is the largest n, `--stride` the distance of those that are tried. The status is 0 if nothing was found, 1
// if something was, 2 for arguments that make no sense.
#include "bullet/simulation.h"  // first: see there

#include <fstream>
#include <functional>
#include <iostream>

#include "fuzz/arguments.h"
#include "fuzz/failing_allocations.h"
#include "fuzz/finding.h"
#include "fuzz/isolation.h"
#include "fuzz/readers.h"
#include "penalty/bullet_penalty.h"

namespace penalty::testing {
namespace {

/// Two jellies above the ground, one of them below a cube.
struct Stage {
  explicit Stage(WorldKind kind, Real height, Integrator integrator) : sim(kind) {
    sim.set_gravity({0, -9.81, 0});
    sim.add_ground();
    cube = &sim.add_box({0.3, 0.3, 0.3}, 1, {0.5, height + 1.32, 0.5});
    options.step.integrator = integrator;
    options.step.damping_time = 0.002;
    body = &sim.add(make_soft_body(sim.info(), moved(mesh, {0, height, 0})));
    other = &sim.add(make_soft_body(sim.info(), moved(mesh, {3, height, 0})));
    sim.penalty().attach(*other, field(), options);
    positions = PackedVectors::Zero(4, recovering.num_particles());
  }

  PotentialField field() const { return make_elastic_field(mesh.vertices, mesh.tetrahedra, 50); }

  void couple() {
    Eigen::Matrix3Xd rest(3, 3);
    rest << 0, 1, 2, 0, 0, 0, 0, 0, 0;
    PotentialField joint(rest);
    joint.add<Length>(std::vector<Edge>{{0, 1}, {1, 2}}, 10);
    sim.penalty().couple(
        {CouplingPoint::at_node(*body, 0), CouplingPoint::at_node(*other, 0), CouplingPoint::on(*cube, {0, 0, 0})},
        std::move(joint));
  }

  std::vector<PackedVectors> places() {
    std::vector<PackedVectors> result;
    for (btSoftBody* soft : {body, other})
      if (sim.penalty().is_attached(*soft)) result.push_back(sim.penalty().particles(*soft).positions);
    return result;
  }

  TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  Simulation sim;
  btSoftBody *body = nullptr, *other = nullptr;
  btRigidBody* cube = nullptr;
  AttachOptions options;

  // Of calls that need no world.
  PotentialField recovering = make_recovering_field(mesh.vertices, mesh.tetrahedra, Material{});
  PackedVectors positions;
  TriangleSurface sphere = make_sphere(1, 3);
  std::filesystem::path file;
};

enum class Before { nothing, attached, recovering, coupled };  // what has happened to the body

struct Call {
  const char* name;
  void (*act)(Stage&);
  Before before = Before::attached;
  int steps_before = 3;
  Real height = 0.02;  // of the bodies: they fall, and touch the ground
  Integrator integrator = Integrator::automatic;
  bool is_step = false;
};

void world_step(Stage& stage) { stage.sim.step(1.0 / 60); }

void save_and_restore(PotentialField& field) { field.set_state(field.state()); }

const std::vector<Call>& calls() {
  static const std::vector<Call> all{
      {"attach", [](Stage& s) { s.sim.penalty().attach(*s.body, s.field(), s.options); }, Before::nothing},
      {"attach again", [](Stage& s) { s.sim.penalty().attach(*s.body, s.field(), s.options); }},
      {"detach", [](Stage& s) { s.sim.penalty().detach(*s.body); }},
      {"first step", world_step, Before::attached, 0, 3, Integrator::explicit_step, true},
      {"explicit step", world_step, Before::attached, 3, 3, Integrator::explicit_step, true},
      {"first implicit step", world_step, Before::attached, 0, 3, Integrator::implicit_step, true},
      {"implicit step", world_step, Before::attached, 3, 3, Integrator::implicit_step, true},
      {"first step of two phases", world_step, Before::recovering, 0, 3, Integrator::implicit_step, true},
      {"step in contact", world_step, Before::attached, 6, 0.02, Integrator::automatic, true},
      {"couple", [](Stage& s) { s.couple(); }},
      {"coupled step", world_step, Before::coupled, 0, 0.02, Integrator::automatic, true},
      {"relax", [](Stage& s) { relax(s.recovering, s.positions); }},
      {"read_mesh", [](Stage& s) { read_mesh(s.file); }},
      {"make_soft_body", [](Stage& s) { make_soft_body(s.sim.info(), s.mesh); }},
      {"edit",
       [](Stage& s) {
         ElementBatch& springs = *s.sim.penalty().edit(*s.body).find("length");
         springs.set_target(3, 0.1);
         springs.set_plasticity({.yield = 0.1, .creep = 2});
         springs.set_breaking({.upper = 0.5});
         springs.set_enabled(2, false);
         springs.set_damping_time(0.01);
         springs.set_free_play(-infinite, 0);
       }},
      {"ledger", [](Stage& s) { s.sim.penalty().ledger(*s.body); }},
      {"forces", [](Stage& s) { s.sim.penalty().forces(*s.body); }},
      {"state", [](Stage& s) { save_and_restore(s.sim.penalty().edit(*s.body)); }},
      {"embed", [](Stage& s) { embed(s.sphere, {.cells = 3}); }}};
  return all;
}

std::unique_ptr<Stage> prepare(const Call& call, WorldKind kind, const std::filesystem::path& file) {
  auto stage = std::make_unique<Stage>(kind, call.height, call.integrator);
  stage->file = file;
  AttachedBodies& solver = stage->sim.penalty();
  if (call.before == Before::recovering)
    solver.attach(*stage->body, make_recovering_field(stage->mesh.vertices, stage->mesh.tetrahedra, Material{}),
                  stage->options);
  else if (call.before != Before::nothing)
    solver.attach(*stage->body, stage->field(), stage->options);
  if (call.before == Before::coupled) stage->couple();
  if (call.before != Before::nothing) stage->sim.step(1.0 / 60, call.steps_before);
  return stage;
}

void check_steps_afterwards(Stage& stage) {
  for (int k = 0; k < 5; ++k) {
    stage.sim.step(1.0 / 60);
    for (btSoftBody* body : {stage.body, stage.other}) {
      if (!stage.sim.penalty().is_attached(*body)) continue;
      const Particles& particles = stage.sim.penalty().particles(*body);
      require(stage.sim.penalty().report(*body).finite, "a later step is not finite");
      require(particles.positions.cwiseAbs().maxCoeff() < 10 && particles.velocities.cwiseAbs().maxCoeff() < 20,
              "a later step went astray");
      for (int i = 0; i < particles.size(); ++i)
        require((to_vector(body->m_nodes[i].m_x) - particles.positions.col(i).head<3>()).norm() < limit(1e-9, 1e-5),
                "nodes are not where particles are");
    }
  }
}

/// What a call makes of the bodies when nothing fails, and how many allocations it takes.
struct Undisturbed {
  std::vector<PackedVectors> places;
  long allocations = 0;
};

Undisturbed run_undisturbed(const Call& call, WorldKind kind, const std::filesystem::path& file) {
  const std::unique_ptr<Stage> stage = prepare(call, kind, file);
  FailingAllocations::fail(-1);
  call.act(*stage);
  Undisturbed result{{}, FailingAllocations::stop()};
  result.places = stage->places();
  return result;
}

void run_failing(const Call& call, WorldKind kind, const std::filesystem::path& file, long n,
                 const Undisturbed& undisturbed) {
  const std::unique_ptr<Stage> stage = prepare(call, kind, file);
  const std::vector<PackedVectors> before = stage->places();
  bool thrown = false;
  try {
    FailingAllocations::fail(n);
    call.act(*stage);
    FailingAllocations::stop();
  } catch (const std::bad_alloc&) {
    FailingAllocations::stop();
    thrown = true;
  } catch (const std::exception& error) {
    FailingAllocations::stop();
    throw Finding(std::string("another exception than bad_alloc: ") + error.what());
  }
  require(!thrown || !call.is_step, "an exception left the step");

  const std::vector<PackedVectors> after = stage->places();
  if (thrown) require(after == before, "a call that failed has moved, attached or detached a body");
  if (call.is_step)
    for (std::size_t k = 0; k < after.size(); ++k)
      require(after[k] == before[k] || after[k] == undisturbed.places[k],
              "body " + std::to_string(k) + " is neither where it was nor where the step leads");
  check_steps_afterwards(*stage);
  if (thrown) {
    call.act(*stage);  // as if nothing had been
    check_steps_afterwards(*stage);
  }
}

bool try_all(long most, long stride) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("penalty-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "a.vtk", std::ios::binary) << sample_files(FileFormat::vtk).front();
  std::uint64_t tried = 0, failed = 0;
  for (WorldKind kind : {WorldKind::classic, WorldKind::deformable})
    for (const Call& call : calls()) {
      const Undisturbed undisturbed = run_undisturbed(call, kind, folder / "a.vtk");
      const long last = std::min(most, undisturbed.allocations);
      const auto trial = [&](std::uint64_t number) {
        const long n = static_cast<long>(number) * stride, live = FailingAllocations::live();
        run_failing(call, kind, folder / "a.vtk", n, undisturbed);
        const long left = FailingAllocations::live() - live;
        require(left == 0 || number == 0, std::to_string(left) + " blocks are left");  // the first fills caches
      };
      const IsolationResult result = run_isolated(
          {.count = static_cast<std::uint64_t>((last + stride - 1) / stride),
           .cpu_seconds = 60,
           .name = std::string(call.name) + ", " + world_name(kind) + ", allocation no. / " + std::to_string(stride)},
          trial);
      tried += result.done;
      failed += result.failed;
    }
  std::filesystem::remove_all(folder);
  std::cout << "nth_allocation: " << tried << " allocations failed, " << failed << " times something was found\n";
  return failed == 0;
}

}  // namespace
}  // namespace penalty::testing

int main(int argc, char** argv) try {
  const auto arguments = penalty::testing::read_arguments(argc, argv, {{"--most", 300}, {"--stride", 1}},
                                                          "usage: nth_allocation [--most N] [--stride N]");
  if (!arguments || arguments->at("--stride") < 1) return 2;
  return penalty::testing::try_all(static_cast<long>(arguments->at("--most")),
                                   static_cast<long>(arguments->at("--stride")))
             ? 0
             : 1;
} catch (const std::exception& error) {
  std::cerr << "nth_allocation: " << error.what() << '\n';
  return 1;
}
