// How a body is stepped.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

enum class Integrator {
  automatic,  // explicit up to `crossover_substeps`, else implicit; in contact only what lies, or is too stiff to bounce
  explicit_step,  // sub-cycled velocity Verlet
  implicit_step,  // see implicit_order; with what it touches, but explicit where that is edges that are driven or spin,
  // a rigid body that is jointed, held along an axis or rebounds, or a soft one that is explicit, where surfaces cross
  // from the start, and in couplings
};

/// Substeps up to which sub-cycling costs less than an implicit step with its default options: as many were measured to
/// cost the same in a body of 1280 tetrahedra (81) and in one of 10240 (124). Those of second order cost twice as much.
inline constexpr int crossover_substeps = 100;

/// Of conjugate gradients.
struct LinearOptions {
  int max_iterations = 60;
  Real tolerance = 1e-2;  // reduction of the residual in the norm of the preconditioner

  /// Throws std::invalid_argument that begins with `what` and names the option and its value.
  void check(const char* what) const;
};

/// How a body is stepped. By default only `settling_speed` damps, and that only what lies almost still. (Far from rest the
/// energy guard still takes a little: it repeats steps that gain energy, not those that lose it.)
struct StepOptions {
  Integrator integrator = Integrator::automatic;
  /// Ratio of damping to stiffness along the constraint gradients, beta [s]: a mode of angular frequency w decays as
  /// exp(-beta w² t / 2).
  Real damping_time = 0;
  Real drag = 0;  // rate at which all velocities decay [1/s]; does not keep momentum
  /// What something at rest holds, through other bodies too, and moves slower than this share of sqrt(g * size), comes
  /// to rest, but for rigid motion that its contacts leave free. 0: only by damping and friction.
  Real settling_speed = 0.1;
  int substeps = 0;               // in a step; 0: from the stability limit; surfaces that meet fast take more
  Real safety = 0.99;             // share of the stability limit that a substep may use, in (0, 1]
  Real contact_safety = 0.7;      // the same while the body is in contact: impacts excite the fastest modes
  Real energy_tolerance = 0.005;  // relative growth of energy in a step above which it is repeated with more substeps
  int max_substeps = 20000;       // beyond this a step is taken as it is, if it is finite
  Real contact_slop = 1e-4;       // depth that is left alone [m]; of what is smaller than a metre so much less
  // Of implicit steps. 1: backward Euler, in which nothing rings or bounces. 2: TR-BDF2 as long as nothing touches, which
  // keeps oscillations of more than some ten steps a period; in contact backward Euler for what lies, and substeps for
  // impacts. Where a body of order 1 takes part, all have that.
  int implicit_order = 1;
  int newton_iterations = 8;     // most of an implicit step; in contact three times as many
  Real newton_tolerance = 1e-3;  // ends them: what is left of the forces that are not balanced, in the norm of the
                                 // preconditioner; in contact of those that inertia would need for the whole way
  LinearOptions linear = {};     // of each Newton iteration
  bool unfold = true;            // out of a plane, a line or a point: see penalty::unfold

  /// Throws std::invalid_argument that names the option and its value.
  void check() const;
};

}  // namespace penalty
