// What may change about an element without changing its kind: its target, free play, plastic flow, its end.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"
#include "penalty/math/types.h"

namespace penalty {

/// Which part of C is resisted: E = K/2 s² with the strain s = d - clamp(d, lower, upper), d = C - target. In between,
/// the element is slack: no force. `lower == upper == 0`, the default, resists everything.
///
///     s |         /          target    the C that counts as rest: muscles, inflation, plastic flow
///       |        /           (-inf, 0) only stretching is resisted: a rope
///     --+---====/----- d     (0, inf)  only compression: a stop
///       |  /lower upper      (a, b)    free between a and b
struct Profile {
  Real target = 0, lower = 0, upper = 0;
  Real period = 0;  // of a C that is an angle: d is then the shorter way round from the target; 0: C is no angle

  Real offset(Real c) const { return period > 0 ? std::remainder(c - target, period) : c - target; }  // d
  Real strain(Real c) const {
    const Real d = offset(c);
    return d - std::clamp(d, lower, upper);
  }
  bool is_slack(Real c) const {
    const Real d = offset(c);
    return d > lower && d < upper;
  }
  bool is_plain() const { return target == 0 && lower == 0 && upper == 0; }
};

inline constexpr Real infinite = std::numeric_limits<Real>::infinity();

/// Plastic flow (Müller and Gross 2004; Teschner et al. 2004): while |s| exceeds `yield`, the target follows C at the
/// rate `creep` s until the plastic part of the target reaches `limit`. All three in units of C.
struct Plasticity {
  Real yield = infinite;  // strain that is still elastic
  Real creep = infinite;  // [1/s]; infinite: at once down to the yield strain
  Real limit = infinite;  // largest plastic strain

  /// The plastic strain after `duration` [s] at strain `s` and unchanged C. Exact, so that any duration is stable: s
  /// decays as exp(-creep t) until it has come down to the yield strain.
  Real flow(Real plastic, Real s, Real duration) const {
    const Real magnitude = std::abs(s);
    if (!(magnitude > yield)) return plastic;
    const Real left = std::max(yield, creep == infinite ? 0 : magnitude * std::exp(-creep * duration));
    const Real flown = plastic + std::copysign(magnitude - left, s);
    // What is beyond the limit already, say after a change of it, does not jump back.
    const Real bound = std::max(limit, std::abs(plastic));
    return std::clamp(flown, -bound, bound);
  }

  /// Throws std::invalid_argument that names the number out of range.
  void check() const {
    const auto require = [](Real value, const char* what) {
      if (!(value >= 0))
        throw std::invalid_argument(std::string("plasticity: ") + what + " is " + to_text(value) +
                                    ", must be zero or positive");
    };
    require(yield, "yield");
    require(creep, "creep");
    require(limit, "limit");
  }
};

/// The strains beyond which an element breaks and leaves the field.
struct Breaking {
  Real upper = infinite;   // of stretching
  Real lower = -infinite;  // of compression

  bool breaks(Real s) const { return s > upper || s < lower; }

  /// Throws std::invalid_argument unless lower < 0 < upper.
  void check() const {
    if (!(upper > 0)) throw std::invalid_argument("breaking: upper strain is " + to_text(upper) + ", must be positive");
    if (!(lower < 0)) throw std::invalid_argument("breaking: lower strain is " + to_text(lower) + ", must be negative");
  }
};

}  // namespace penalty
