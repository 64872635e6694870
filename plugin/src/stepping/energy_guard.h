// Steps that gain energy are repeated: the same rule for every integrator.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "penalty/math/types.h"

namespace penalty {

/// What one attempt at a step came to.
struct Attempt {
  int substeps;  // that were taken
  Real energy;   // kinetic + elastic, at the end [J]
  Real allowed;  // what it may be: that of the start and what came in from outside [J]
  Real noise;    // growth beyond it that means nothing [J]
};

struct GuardRules {
  int most_substeps;              // after which a step is taken as it is
  Real factor;                    // of the substeps of a repeated step,
  int increment = 0;              // and what is added
  bool forgives_outside = false;  // growth that substeps do not reduce is outside work that nobody booked
};

struct GuardedStep {
  Attempt attempt;  // that was kept
  int retries = 0;
  bool finite = true;  // else the attempt is still to be undone
};

/// Calls attempt(substeps) until the energy at its end is finite and no more than is allowed, undo() in between.
template <class Try, class Undo>
GuardedStep guard_energy(int substeps, Real start_energy, const GuardRules& rules, const Try& attempt,
                         const Undo& undo) {
  constexpr Real doubtful = 0.2;      // growth relative to the energy that is never taken for outside work
  constexpr Real unresponsive = 0.8;  // growth that substeps do not reduce below this share is outside work
  Real last_growth = std::numeric_limits<Real>::infinity();
  for (int retries = 0;; ++retries) {
    const Attempt tried = attempt(substeps);
    const bool finite = std::isfinite(tried.energy);
    const Real growth = tried.energy - tried.allowed;
    const bool forgiven = rules.forgives_outside && growth > unresponsive * last_growth &&
                          growth < doubtful * std::max(start_energy, tried.energy);
    const bool accepted = finite && (!(growth > tried.noise) || forgiven);
    if (accepted || tried.substeps >= rules.most_substeps || !std::isfinite(start_energy))
      return {tried, retries, finite};
    last_growth = finite ? growth : std::numeric_limits<Real>::infinity();
    substeps = static_cast<int>(
        std::min<Real>(std::floor(rules.factor * tried.substeps) + rules.increment, rules.most_substeps));
    undo();
  }
}

}  // namespace penalty
