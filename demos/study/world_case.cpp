#include <cmath>

#include "scenes/scene.h"
#include "study/recovery_watch.h"
#include "study/run_case.h"

namespace penalty::study {
namespace {

constexpr std::string_view scene_name = "recover";  // one free body, of the material "recovering"
constexpr Real rate = 60;                           // world steps a second
constexpr Real early = 5;                           // when a longer run is looked at in between [s]

}  // namespace

StudyResult run_world_case(const StudyCase& which, const demo::BodyMesh& body) {
  StudyResult result{.which = which,
                     .vertices = static_cast<int>(body.vertices().cols()),
                     .tetrahedra = static_cast<int>(body.tetrahedra().size())};
  const demo::ShapeMeasure measure(body.vertices(), body.tetrahedra());
  demo::SceneOptions options;
  options.start = demo::start_from_name(which.start);
  options.seed = which.seed;
  demo::Scene scene(demo::find_scene(scene_name).setup(options, body), demo::world_from_name(which.method));

  RecoveryWatch watch;
  bool finite = true;
  const auto steps = static_cast<int>(std::lround(which.duration * rate)), early_step = static_cast<int>(early * rate);
  for (int step = 1; step <= steps; ++step) {
    const Real start = thread_cpu_seconds();
    scene.step(1 / rate);
    result.cpu_seconds += thread_cpu_seconds() - start;
    finite = finite && scene.report().finite;
    const Real error = measure.rest_error(scene.particles().positions);
    watch.see(error, {step / rate, result.cpu_seconds});
    if (step == early_step && step < steps) result.rest_error_at_5s = error;
  }

  result.iterations = steps;
  result.end = finite ? "finite" : "not finite";
  measure_end(result, measure, scene.particles().positions);
  if (const auto& since = watch.since()) {
    result.to_recover = since->progress;
    result.cpu_seconds_to_recover = since->cpu_seconds;
  }
  return result;
}

}  // namespace penalty::study
