// Central differences: the twins of the closed forms, for tests and for constraints that come without a gradient.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Gradient of `value(points)` by central differences, (C(p + h e) - C(p - h e)) / 2h for each coordinate (seed eq.
/// 4-6). `step` h in metres: about 6e-6 times the size of the stencil balances truncation against round-off.
template <int N, class Value>
Gradient<N> central_difference_gradient(const Value& value, const Points<N>& points, Real step) {
  Gradient<N> gradient(3, points.cols());
  Points<N> moved = points;
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    Real& coordinate = moved.data()[k];
    const Real start = coordinate;
    coordinate = start + step;
    const Real above = value(moved);
    coordinate = start - step;
    const Real below = value(moved);
    coordinate = start;
    gradient.data()[k] = (above - below) / (2 * step);
  }
  return gradient;
}

/// Hessian from central differences of `gradient(points)`, one column per coordinate; not symmetrised.
template <int N, class GradientFunction>
Hessian<N> central_difference_hessian(const GradientFunction& gradient, const Points<N>& points, Real step) {
  Hessian<N> hessian(points.size(), points.size());
  Points<N> moved = points;
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    Real& coordinate = moved.data()[k];
    const Real start = coordinate;
    coordinate = start + step;
    const Gradient<N> above = gradient(moved);
    coordinate = start - step;
    const Gradient<N> below = gradient(moved);
    coordinate = start;
    hessian.col(k) = (above - below).reshaped() / (2 * step);
  }
  return hessian;
}

}  // namespace penalty
