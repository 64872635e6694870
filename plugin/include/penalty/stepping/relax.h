// Static relaxation: the rest state of least potential.
#pragma once
#include <functional>
#include <string>

#include "penalty/fields/potential_field.h"
#include "penalty/stepping/step_options.h"

namespace penalty {

/// Where a relaxation is after an iteration.
struct RelaxProgress {
  int iteration = 0;
  Real energy = 0;                           // of the potential, less the work of the loads [J]
  Real residual = 0;                         // largest force that is not balanced [N]
  Real step = 0;                             // largest displacement that Newton's method asked for [m]
  const PackedVectors* positions = nullptr;  // where the particles are [m]; during the call only
};

struct RelaxOptions {
  int max_iterations = 500;
  /// Ends it: the largest displacement of a full Newton step, over the diagonal of the rest bounding box.
  Real tolerance = 1e-9;
  LinearOptions linear = {};
  std::vector<int> pinned = {};  // particles that stay where they are
  PackedVectors loads = {};      // constant forces, column i on particle i [N]; empty: none
  /// Particles that lie in a space of fewer dimensions than at rest, a plane, a line or a point, are moved out of it,
  /// see penalty::unfold: forces alone may not.
  bool unfold = true;
  /// Called after every iteration; false ends the relaxation there.
  std::function<bool(const RelaxProgress&)> observe = {};
};

enum class RelaxEnd {
  converged,
  iteration_limit,
  cancelled,
  no_descent,  // round-off: the line search finds nothing lower, yet the tolerance is not met
  not_finite,  // the potential is not finite at the start
};

struct RelaxReport {
  RelaxEnd end = RelaxEnd::converged;
  int iterations = 0, linear_iterations = 0;
  Real energy = 0, residual = 0, step = 0;  // as in RelaxProgress, at the end
  bool unfolded = false;                    // see RelaxOptions

  bool converged() const { return end == RelaxEnd::converged; }
  std::string message() const;  // one line
};

/// Moves `positions`, column i that of particle i [m], to a minimum of the potential, by projected Newton iterations
/// with a line search: the energy only falls, but for round-off. What is not pinned stays free to turn and drift as a
/// whole. A potential of several phases changes them on the way. The minimum is a local one: of a body at rest the
/// energy is zero, so look at it.
///
/// Throws std::invalid_argument for positions or loads of another size than the field has particles, positions or loads
/// that are not finite, a pinned index out of range, and options out of range; it names what, which and the value.
RelaxReport relax(PotentialField& field, PackedVectors& positions, const RelaxOptions& options = {});

}  // namespace penalty
