// What contacts of every sort have in common.
#pragma once
#include <algorithm>

#include "penalty/math/types.h"

namespace penalty {

inline constexpr Real recovery_time = 0.05;  // in which depth is taken back [s],
inline constexpr Real recovery_speed = 0.5;  // no faster than this [m/s]
/// Between bodies that can move, against whatever presses them together, nothing gathers speed faster than this [m/s²].
inline constexpr Real recovery_acceleration = 100;
/// The same of the thickness that surfaces lost [m/s], and the share of it that they may lose.
inline constexpr Real lost_thickness_speed = 0.02, lost_share = 0.02;

/// The speed at which depth [m], beyond what is left alone, is taken back in a drift of h [s].
inline Real recovery_of(Real depth, Real left_alone, Real h) {
  return std::clamp<Real>((depth - left_alone) / std::max(recovery_time, h), 0, recovery_speed);
}

/// Friction of the size that Coulomb's law allows: `v`, shortened if it is longer than `most`.
template <class Derived>
typename Derived::PlainObject no_longer_than(Real most, const Eigen::MatrixBase<Derived>& v) {
  typename Derived::PlainObject result = v;
  if (const Real size = result.norm(); size > most) result *= most / size;
  return result;
}

}  // namespace penalty
