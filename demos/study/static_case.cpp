#include "penalty/stepping/relax.h"
#include "scenes/start_shapes.h"
#include "study/recovery_watch.h"
#include "study/run_case.h"
#include "study/study_materials.h"

namespace penalty::study {
namespace {

/// More than by default: a body that is merely slow shall not count as one that is stuck.
constexpr int max_iterations = 2000;

const char* name_of(RelaxEnd end) {
  switch (end) {
    case RelaxEnd::converged:
      return "converged";
    case RelaxEnd::iteration_limit:
      return "iteration limit";
    case RelaxEnd::cancelled:
      return "cancelled";
    case RelaxEnd::no_descent:
      return "no descent";
    case RelaxEnd::not_finite:
      return "not finite";
  }
  return "";
}

}  // namespace

StudyResult run_case(const StudyCase& which, const demo::BodyMesh& body) {
  return which.is_static() ? run_static_case(which, body) : run_world_case(which, body);
}

StudyResult run_static_case(const StudyCase& which, const demo::BodyMesh& body) {
  const TetMesh& mesh = body.solid();
  StudyResult result{.which = which,
                     .vertices = static_cast<int>(mesh.vertices.cols()),
                     .tetrahedra = static_cast<int>(mesh.tetrahedra.size())};
  PotentialField field = find_material(which.material).make(mesh);
  PackedVectors x = pack(demo::start_positions(mesh.vertices, demo::start_from_name(which.start), which.seed));
  const demo::ShapeMeasure measure(mesh.vertices, mesh.tetrahedra);

  RecoveryWatch watch;
  Real measuring = 0;
  const Real start = thread_cpu_seconds();
  const auto see = [&](const PackedVectors& positions, int iteration) {
    const Real now = thread_cpu_seconds();
    watch.see(measure.rest_error(positions), {static_cast<Real>(iteration), now - start - measuring});
    measuring += thread_cpu_seconds() - now;
  };
  RelaxOptions options{.max_iterations = max_iterations};
  options.observe = [&](const RelaxProgress& progress) {
    see(*progress.positions, progress.iteration);
    return true;
  };
  const RelaxReport report = relax(field, x, options);
  result.cpu_seconds = thread_cpu_seconds() - start - measuring;
  see(x, report.iterations);

  result.iterations = report.iterations;
  result.end = name_of(report.end);
  measure_end(result, measure, x);
  if (const auto& since = watch.since()) {
    result.to_recover = since->progress;
    result.cpu_seconds_to_recover = since->cpu_seconds;
  }
  return result;
}

}  // namespace penalty::study
