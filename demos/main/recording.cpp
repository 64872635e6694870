#include "main/recording.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <sstream>

namespace penalty::demo {
namespace {

/// CPU time of this thread: other programs on the machine do not count [ms].
Real thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<Real>(now.tv_sec) + 1e-6 * static_cast<Real>(now.tv_nsec);
}

/// Values of elements handed down to their vertices, and divided by weights handed down in the same way.
class VertexMean {
 public:
  explicit VertexMean(Eigen::Index vertices) : sums_(Eigen::VectorXd::Zero(vertices)), weights_(sums_) {}

  template <std::size_t N>
  void add(const std::array<int, N>& stencil, Real value, Real weight) {
    for (int i : stencil) {
      sums_[i] += value / N;
      weights_[i] += weight / N;
    }
  }

  Eigen::VectorXd means() const { return (weights_.array() > 0).select(sums_.array() / weights_.array(), 0); }

 private:
  Eigen::VectorXd sums_, weights_;
};

/// Elastic energy over rest volume [J/m³].
Eigen::VectorXd energy_densities(const Scene& scene) {
  const TetMesh& mesh = scene.setup().body.mesh;
  VertexMean mean(mesh.vertices.cols());
  const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
  for (std::size_t t = 0; t < volumes.size(); ++t) mean.add(mesh.tetrahedra[t], 0, volumes[t]);
  const auto add = [&]<class Kind>(const Batch<Kind>* batch) {
    if (!batch) return;
    std::vector<Real> c;
    batch->append_values(scene.particles().positions, c);
    for (std::size_t e = 0; e < c.size(); ++e)
      mean.add(batch->stencils()[e], batch->stiffnesses()[e] / 2 * c[e] * c[e], 0);
  };
  add(scene.field().find<Length>());
  add(scene.field().find<TetrahedronVolume>());
  return mean.means();
}

/// Mean |C| of the lengths around a vertex.
Eigen::VectorXd strains(const Scene& scene) {
  VertexMean mean(scene.setup().body.mesh.vertices.cols());
  if (const auto* batch = scene.field().find<Length>()) {
    std::vector<Real> c;
    batch->append_values(scene.particles().positions, c);
    for (std::size_t e = 0; e < c.size(); ++e) mean.add(batch->stencils()[e], std::abs(c[e]), 1);
  }
  return mean.means();
}

std::string failure_message(const Scene& scene, long step, Real time) {
  std::ostringstream text;
  const int particle = scene.report().first_bad_particle;
  text << "step " << step << " (t = " << time << " s) is not finite";
  if (particle >= 0) {
    text << " at particle " << particle;
    const auto& tetrahedra = scene.setup().body.mesh.tetrahedra;
    const auto with = std::find_if(tetrahedra.begin(), tetrahedra.end(), [particle](const Tetrahedron& t) {
      return std::find(t.begin(), t.end(), particle) != t.end();
    });
    if (with != tetrahedra.end()) text << ", first of all in tetrahedron " << with - tetrahedra.begin();
  }
  return text.str();
}

}  // namespace

FramePlan plan_frames(Real duration, Real rate) {
  constexpr Real frames_per_second = 30, most_frames = 900;
  FramePlan plan;
  plan.frames_per_second = std::min(frames_per_second, rate);
  plan.interval = std::max(1 / plan.frames_per_second, duration / most_frames);
  return plan;
}

Recording record(Scene& scene, const RunOptions& options, long steps, const FramePlan& frames,
                 const std::function<void(long)>& progress) {
  const Real dt = 1 / options.rate;
  const TetMesh& mesh = scene.setup().body.mesh;
  const ShapeMeasure measure(mesh.vertices, mesh.tetrahedra);
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
                      .substeps = report.substeps,
                      .retries = report.retries,
                      .milliseconds = milliseconds,
                      .tip_drop = scene.tip_drop()};
    recording.steps.push_back(record);
    const Momenta now = scene.momenta();
    linear_drift = std::max(linear_drift, (now.linear - start.linear).norm());
    angular_drift = std::max(angular_drift, (now.angular - start.angular).norm());
    linear_scale = std::max(linear_scale, now.linear_scale);
    angular_scale = std::max(angular_scale, now.angular_scale);
    if (frames.interval > 0 && (time >= next_frame - dt / 4)) {
      recording.frames.push_back({time, scene.particles().positions.topRows<3>(),
                                  options.coloring == Coloring::energy ? energy_densities(scene) : strains(scene),
                                  scene.balls()});
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

  recording.rest_error = measure.rest_error(scene.particles().positions);
  if (scene.is_free()) {
    recording.linear_drift = linear_scale > 0 ? linear_drift / linear_scale : 0;
    recording.angular_drift = angular_scale > 0 ? angular_drift / angular_scale : 0;
  }
  return recording;
}

}  // namespace penalty::demo
