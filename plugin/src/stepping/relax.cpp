#include "penalty/stepping/relax.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "penalty/math/affine_span.h"
#include "penalty/stepping/newton.h"

namespace penalty {
namespace {

constexpr Real regularization = 1e-7;  // of the mean stiffness: free bodies and flat states have directions without any

void check(const PotentialField& field, const PackedVectors& positions, const RelaxOptions& options) {
  const auto fail = [](const std::string& what) { throw std::invalid_argument("relax: " + what); };
  const auto check_columns = [&](const PackedVectors& vectors, const std::string& what) {
    if (vectors.cols() != field.num_particles())
      fail(std::to_string(vectors.cols()) + " " + what + "s for " + std::to_string(field.num_particles()) +
           " particles");
    for (Eigen::Index i = 0; i < vectors.cols(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        if (!std::isfinite(vectors(axis, i)))
          fail(what + " " + std::to_string(i) + ": coordinate " + "xyz"[axis] + " is " + to_text(vectors(axis, i)));
  };
  check_columns(positions, "position");
  if (options.loads.size() != 0) check_columns(options.loads, "load");
  for (const int i : options.pinned)
    if (i < 0 || i >= field.num_particles())
      fail("pinned particle " + std::to_string(i) + " is outside the " + std::to_string(field.num_particles()) +
           " of the field");
  if (options.max_iterations < 0)
    fail("max_iterations is " + std::to_string(options.max_iterations) + ", must be zero or positive");
  if (!(options.tolerance > 0)) fail("tolerance is " + to_text(options.tolerance) + ", must be positive");
  options.linear.check("relax");
}

}  // namespace

std::string RelaxReport::message() const {
  const std::string numbers = ", energy " + to_text(energy) + " J, largest force " + to_text(residual) + " N";
  const std::string after = " after " + std::to_string(iterations) + " iterations" + numbers;
  switch (end) {
    case RelaxEnd::converged:
      return "converged" + after;
    case RelaxEnd::iteration_limit:
      return "stopped by the limit" + after;
    case RelaxEnd::cancelled:
      return "cancelled" + after;
    case RelaxEnd::no_descent:
      return "stopped by round-off" + after;
    case RelaxEnd::not_finite:
      return "the potential is not finite at the start";
  }
  return "";
}

RelaxReport relax(PotentialField& field, PackedVectors& positions, const RelaxOptions& options) {
  check(field, positions, options);
  RelaxReport report;
  const PackedVectors& rest = field.rest_positions();
  if (rest.cols() == 0) return report;

  std::vector<int> pinned = options.pinned;
  std::sort(pinned.begin(), pinned.end());
  pinned.erase(std::unique(pinned.begin(), pinned.end()), pinned.end());
  if (options.unfold) {
    std::vector<Real> inverse_masses(static_cast<std::size_t>(rest.cols()), 1);
    for (const int i : pinned) inverse_masses[static_cast<std::size_t>(i)] = 0;
    report.unfolded = unfold(positions, rest, affine_span(rest), inverse_masses);
  }

  NewtonBody body;
  body.set_pattern(field);
  for (const int i : pinned) body.fix(i);
  body.loads = options.loads;
  NewtonSolver newton;
  newton.objective.bodies = {&body};
  newton.linear = options.linear;
  newton.regularization = regularization;
  newton.prepare();
  field.choose_phase(positions);
  newton.start(positions);
  const auto look = [&] {
    report.energy = newton.value();
    report.residual = std::sqrt(newton.gradient().colwise().squaredNorm().maxCoeff());
  };
  look();
  if (!std::isfinite(report.energy) || !std::isfinite(report.residual)) {
    report.end = RelaxEnd::not_finite;
    return report;
  }

  const Real diagonal = (rest.topRows<3>().rowwise().maxCoeff() - rest.topRows<3>().rowwise().minCoeff()).norm();
  const Real enough = options.tolerance * diagonal;
  report.end = RelaxEnd::iteration_limit;
  while (report.iterations < options.max_iterations) {
    const NewtonIteration iteration = newton.iterate();
    ++report.iterations;
    report.linear_iterations += iteration.linear_iterations;
    report.step = iteration.displacement;
    const bool changed = field.choose_phase(newton.positions()) != 0;
    if (changed) newton.start(PackedVectors(newton.positions()));
    look();
    if (!changed && iteration.displacement <= enough && (iteration.length == 1 || iteration.length == 0)) {
      report.end = RelaxEnd::converged;
      break;
    }
    if (!changed && iteration.length == 0) {
      report.end = RelaxEnd::no_descent;
      break;
    }
    if (options.observe &&
        !options.observe({report.iterations, report.energy, report.residual, report.step, &newton.positions()})) {
      report.end = RelaxEnd::cancelled;
      break;
    }
  }
  positions = newton.positions();
  return report;
}

}  // namespace penalty
