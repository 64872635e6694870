#include "main/recording.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <sstream>

#include "main/readable.h"
#include "scenes/unbroken_triangles.h"

namespace penalty::demo {
namespace {

/// CPU time of this thread: other programs on the machine do not count [ms].
Real thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<Real>(now.tv_sec) + 1e-6 * static_cast<Real>(now.tv_nsec);
}

/// The soft bodies of a scene, and what they are measured by.
class Bodies {
 public:
  explicit Bodies(const Scene& scene) : scene_(scene), objects_(scene.setup().bodies) {
    for (const SoftObject& object : objects_) {
      measures_.emplace_back(object.mesh.vertices(), object.mesh.edges(), object.mesh.tetrahedra());
      shares_.push_back(object.mesh.vertex_shares());
    }
  }

  ShapeErrors errors() const {
    ShapeErrors sum;
    for (std::size_t b = 0; b < measures_.size(); ++b) sum += measures_[b].errors(positions(b));
    return sum;
  }

  Real rest_error() const {
    Real largest = 0;
    for (std::size_t b = 0; b < measures_.size(); ++b)
      if (const Real error = measures_[b].rest_error(positions(b)); !(error <= largest)) largest = error;
    return largest;
  }

  std::vector<SoftRecord> records(Coloring coloring) const {
    std::vector<SoftRecord> records;
    records.reserve(objects_.size());
    for (std::size_t b = 0; b < objects_.size(); ++b)
      records.push_back({positions(b).topRows<3>(),
                         coloring == Coloring::energy ? energy_densities(b) : measures_[b].vertex_strains(positions(b)),
                         unbroken_triangles(objects_[b].mesh, scene_.field(b))});
    return records;
  }

 private:
  const PackedVectors& positions(std::size_t body) const { return scene_.particles(body).positions; }

  /// Elastic energy over rest volume [J/m³], of a shell over rest area [J/m²]; 0 where a vertex stands for none.
  Eigen::VectorXd energy_densities(std::size_t body) const {
    const Eigen::VectorXd energies = particle_energies(scene_.field(body), positions(body));
    return (shares_[body].array() > 0).select(energies.array() / shares_[body].array(), 0);
  }

  const Scene& scene_;
  const std::vector<SoftObject>& objects_;
  std::vector<ShapeMeasure> measures_;
  std::vector<Eigen::VectorXd> shares_;  // of the vertices, in volume or area
};

std::string failure_message(const Scene& scene, long step, Real time) {
  std::ostringstream text;
  text << "step " << step << " (t = " << readable(time) << " s) is not finite";
  const std::vector<SoftObject>& bodies = scene.setup().bodies;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const int particle = scene.report(b).first_bad_particle;
    if (particle < 0) continue;
    text << " at particle " << particle;
    if (bodies.size() > 1) text << " of body " << b;
    const std::span<const Tetrahedron> tetrahedra = bodies[b].mesh.tetrahedra();
    const auto with = std::find_if(tetrahedra.begin(), tetrahedra.end(), [particle](const Tetrahedron& t) {
      return std::find(t.begin(), t.end(), particle) != t.end();
    });
    if (with != tetrahedra.end()) text << ", first of all in tetrahedron " << with - tetrahedra.begin();
    break;
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
  const Bodies bodies(scene);
  Recording recording;
  recording.seed = options.scene_options.seed;

  const Momenta start = scene.momenta();
  Real linear_drift = 0, angular_drift = 0, linear_scale = 0, angular_scale = 0;
  Real next_frame = 0;
  const auto look = [&](long step, const Energies& energies, Real milliseconds) {
    const Real time = static_cast<Real>(step) * dt;
    const StepReport report = scene.report();
    StepRecord record{.time = time,
                      .energies = energies,
                      .errors = bodies.errors(),
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
      recording.frames.push_back({time, bodies.records(coloring(options, scene.setup())), scene.objects()});
      next_frame += frames.interval;
    }
  };

  look(0, scene.energies(), 0);
  for (long step = 1; step <= steps; ++step) {
    const Real before = thread_milliseconds();
    scene.step(dt);
    const Real spent = thread_milliseconds() - before;
    const Energies energies = scene.energies();
    if (!scene.report().finite || !std::isfinite(energies.total())) {
      recording.finite = false;
      recording.failure = failure_message(scene, step, static_cast<Real>(step) * dt);
      break;
    }
    look(step, energies, spent);
    progress(step);
  }

  recording.facts = scene.facts();
  recording.rest_error = bodies.rest_error();
  if (scene.is_free()) {
    recording.linear_drift = linear_scale > 0 ? linear_drift / linear_scale : 0;
    recording.angular_drift = angular_scale > 0 ? angular_drift / angular_scale : 0;
  }
  return recording;
}

}  // namespace penalty::demo
