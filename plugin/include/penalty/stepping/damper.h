// The damping of a body over a part of a step.
#pragma once
#include <cstdint>

#include "penalty/fields/potential_field.h"
#include "penalty/stepping/particles.h"

namespace penalty {

/// Lets M dv/dt = -D v act at the present positions, D the damping matrix of a field, by one step of the first-order
/// Runge-Kutta-Chebyshev method (van der Houwen and Sommeijer, ZAMM 60, 479, 1980):
///
///     R_s(z) = T_s(w0 - w1 z) / T_s(w0),   w0 = cosh(d / s),  w1 = sinh(d / s) / (s tanh(d)),  cosh d = 2
///
/// takes s products with D and no solution, has the slope -1 at z = 0 whatever s is, so that slow modes decay as they
/// should, and |R_s| <= 1 up to z of about 1.3 s², where the fastest mode is to lie. Each stage adds impulses of
/// elements: momenta stay what they are.
class Damper {
 public:
  struct Damped {
    Real lost = 0;          // energy [J]
    Real driving_work = 0;  // of whoever moves what is held, through the damping [J]
    Real share = 1;         // of D that the most stages allowed; 0 where it had grown too stiff for all that were tried
  };

  /// `damping_time` as in Potential::add_damping [s]. Pinned particles keep their velocity. Without allocation but where
  /// elements, phases or times have changed.
  Damped damp(const PotentialField& field, Real damping_time, Real duration, Particles& particles);

  /// The next `damp` measures anew how much stiffer than at rest the damping has become.
  void begin_step() { growth_ = 0; }

  /// To be called after a change of masses.
  void forget() { is_prepared_ = false; }

 private:
  void prepare(const PotentialField& field, Real damping_time, const Particles& particles);
  bool has_modes(const PotentialField& field, std::size_t potential) const;
  void add_modes(const PotentialField& field, const Positions& x, Real damping_time, Real duration,
                 DampingModes& modes) const;
  Real row_bound(const Particles& particles);
  void run_stages(int stages, Real share, const Particles& particles);
  Real work_of_what_is_held(const Particles& particles) const;

  bool is_prepared_ = false;
  std::uint64_t stiffness_version_ = 0;
  std::vector<bool> had_modes_;  // each potential, and acted
  Real damping_time_ = 0;
  Real rest_eigenvalue_ = 0, rest_bound_ = 0;  // of M^-1 D at rest [1/s]
  Real growth_ = 0;                            // of the latter since then; 0: not measured
  DampingModes modes_;
  std::vector<Real> bounds_;
  PackedVectors now_, change_, change_before_, product_;
};

}  // namespace penalty
