#include "main/recording.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <sstream>

#include "main/readable.h"
#include "scenes/element_energy.h"

namespace penalty::demo {
namespace {

/// CPU time of this thread: other programs on the machine do not count [ms].
Real thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<Real>(now.tv_sec) + 1e-6 * static_cast<Real>(now.tv_nsec);
}

/// Elastic energy over rest volume [J/m³], of a shell over rest area [J/m²]; 0 where a vertex stands for none.
Eigen::VectorXd energy_densities(const Scene& scene, const Eigen::VectorXd& shares) {
  const Eigen::VectorXd energies = particle_energies(scene.field(), scene.particles().positions);
  return (shares.array() > 0).select(energies.array() / shares.array(), 0);
}

std::string failure_message(const Scene& scene, long step, Real time) {
  std::ostringstream text;
  const int particle = scene.report().first_bad_particle;
  text << "step " << step << " (t = " << readable(time) << " s) is not finite";
  if (particle >= 0) {
    text << " at particle " << particle;
    const std::span<const Tetrahedron> tetrahedra = scene.setup().body.tetrahedra();
    const auto with = std::find_if(tetrahedra.begin(), tetrahedra.end(), [particle](const Tetrahedron& t) {
      return std::find(t.begin(), t.end(), particle) != t.end();
    });
    if (with != tetrahedra.end()) text << ", first of all in tetrahedron " << with - tetrahedra.begin();
  }
  return text.str();
}

}  // namespace

Real ledger_residual(const std::vector<StepRecord>& steps) {
  const auto energy = [](const StepRecord& step) { return step.energies.elastic + step.energies.kinetic; };
  Real largest = 0;
  for (const StepRecord& step : steps) largest = std::max(largest, energy(step));
  const EnergyFlows& flows = steps.back().flows;
  const Real unexplained = energy(steps.back()) - energy(steps.front()) - flows.received() + flows.lost();
  return largest > 0 ? std::abs(unexplained) / largest : 0;
}

FramePlan plan_frames(Real duration, Real rate) {
  constexpr Real frames_per_second = 30, most_frames = 900;
  FramePlan plan;
  plan.frames_per_second = std::min(frames_per_second, rate);
  plan.interval = std::max(1 / plan.frames_per_second, duration / most_frames);
  return plan;
}

Coloring coloring(const RunOptions& options, const SceneSetup& setup) {
  return options.coloring.value_or(setup.look.strain ? Coloring::strain : Coloring::energy);
}

Recording record(Scene& scene, const RunOptions& options, long steps, const FramePlan& frames,
                 const std::function<void(long)>& progress) {
  const Real dt = 1 / options.rate;
  const BodyMesh& body = scene.setup().body;
  const ShapeMeasure measure(body.vertices(), body.edges(), body.tetrahedra());
  const Eigen::VectorXd shares = body.vertex_shares();
  Recording recording;
  recording.seed = options.scene_options.seed;

  const Momenta start = scene.momenta();
  Real linear_drift = 0, angular_drift = 0, linear_scale = 0, angular_scale = 0;
  Real next_frame = 0;
  const auto look = [&](long step, Real milliseconds) {
    const Real time = static_cast<Real>(step) * dt;
    const StepReport& report = scene.report();
    StepRecord record{.time = time,
                      .energies = scene.energies(),
                      .errors = measure.errors(scene.particles().positions),
                      .penetration = scene.penetration(),
                      .contact_depth = report.contact_depth,
                      .implicit = report.integrator == Integrator::implicit_step,
                      .substeps = report.substeps,
                      .retries = report.retries,
                      .newton_iterations = report.newton_iterations,
                      .milliseconds = milliseconds,
                      .tip_drop = scene.tip_drop(),
                      .batches = scene.ledger(),
                      .flows = scene.flows()};
    recording.steps.push_back(std::move(record));
    const Momenta now = scene.momenta();
    linear_drift = std::max(linear_drift, (now.linear - start.linear).norm());
    angular_drift = std::max(angular_drift, (now.angular - start.angular).norm());
    linear_scale = std::max(linear_scale, now.linear_scale);
    angular_scale = std::max(angular_scale, now.angular_scale);
    if (frames.interval > 0 && (time >= next_frame - dt / 4)) {
      recording.frames.push_back({time, scene.particles().positions.topRows<3>(),
                                  coloring(options, scene.setup()) == Coloring::energy
                                      ? energy_densities(scene, shares)
                                      : measure.vertex_strains(scene.particles().positions),
                                  scene.objects(), unbroken_triangles(body, scene.field())});
      next_frame += frames.interval;
    }
  };

  look(0, 0);
  for (long step = 1; step <= steps; ++step) {
    const Real before = thread_milliseconds();
    scene.step(dt);
    const Real spent = thread_milliseconds() - before;
    if (!scene.report().finite || !std::isfinite(scene.energies().total())) {
      recording.finite = false;
      recording.failure = failure_message(scene, step, static_cast<Real>(step) * dt);
      break;
    }
    look(step, spent);
    progress(step);
  }

  recording.facts = scene.facts();
  recording.rest_error = measure.rest_error(scene.particles().positions);
  if (scene.is_free()) {
    recording.linear_drift = linear_scale > 0 ? linear_drift / linear_scale : 0;
    recording.angular_drift = angular_scale > 0 ? angular_drift / angular_scale : 0;
  }
  return recording;
}

}  // namespace penalty::demo
