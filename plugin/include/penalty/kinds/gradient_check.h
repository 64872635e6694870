// Is the gradient that came with a kind the derivative of its value?
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "penalty/kinds/kind.h"
#include "penalty/math/finite_difference.h"

namespace penalty {

/// The largest extent of the points along an axis [m]; of one point, or of coincident ones, the largest coordinate, and
/// 1 at the origin: what a step for differences is measured by.
template <int N>
Real stencil_size(const Points<N>& points) {
  const Real extent = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
  if (extent > 0) return extent;
  const Real distance = points.cwiseAbs().maxCoeff();
  return distance > 0 ? distance : 1;
}

/// dC/dp_i by central differences (seed eq. 4-6). `moved` equals the points and is moved and put back, so that a
/// stencil of any number of points needs no copy for each of them.
template <int N, class Value>
Vector3 central_difference_column(const Value& value, Points<N>& moved, Eigen::Index i, Real step) {
  const Vector3 start = moved.col(i);
  const auto value_of_one = [&](const Points<1>& point) -> Real {
    moved.col(i) = point;
    return value(moved);
  };
  const Vector3 column = central_difference_gradient<1>(value_of_one, Points<1>(start), step);
  moved.col(i) = start;
  return column;
}

namespace detail {

/// The worst entry of a gradient against central differences.
struct GradientComparison {
  Eigen::Index point = 0;
  int axis = 0;
  Real given = 0, differences = 0;
  Real error = 0;  // of this entry; not-a-number if the entry is not finite
  Real norm = 0;   // of the larger of the two gradients
};

template <ElementKind Kind>
GradientComparison compare_gradient(const Kind& kind, const Points<Kind::num_points>& points, Real step) {
  constexpr int n = Kind::num_points;
  constexpr Eigen::Index most_points = 64;
  Gradient<n> gradient(3, points.cols());
  if constexpr (Constraint<Kind>)
    gradient = kind.gradient(points);
  else
    kind.energy_and_gradient(points, gradient);
  Points<n> moved = points;
  const auto value = [&kind](const Points<n>& p) {
    if constexpr (Constraint<Kind>)
      return kind.value(p);
    else
      return kind.energy(p);
  };
  GradientComparison worst;
  Real given_square = 0, differences_square = 0;
  const Eigen::Index count = std::min(points.cols(), most_points);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index i = k * points.cols() / count;
    const Vector3 differences = central_difference_column<n>(value, moved, i, step);
    given_square += gradient.col(i).squaredNorm();
    differences_square += differences.squaredNorm();
    for (int axis = 0; axis < 3; ++axis) {
      const Real error = std::abs(gradient(axis, i) - differences[axis]);
      if (std::isnan(worst.error) || error <= worst.error) continue;
      worst.point = i;
      worst.axis = axis;
      worst.given = gradient(axis, i);
      worst.differences = differences[axis];
      worst.error = error - error == 0 ? error : std::numeric_limits<Real>::quiet_NaN();
    }
  }
  worst.norm = std::sqrt(std::max(given_square, differences_square));
  return worst;
}

}  // namespace detail

/// Compares gradient(points), of an energy that of `energy_and_gradient`, with central differences at `points`, which
/// are the rest points, and at a copy whose coordinates are moved by up to 10 % of the stencil's size, the same way in
/// every run. Throws std::invalid_argument, one line that begins with `label` and names the worst entry, if an entry is
/// off by more than 1e-4 of the norm of the gradient or is not finite: "user constraint 3: at rest, dC/dp1.y is 0.5,
/// central differences give 0.25". Of more than 64 points only 64, evenly spread, are compared.
///
/// Why 1e-4: central differences of step h are off by h² C'''/6 + 1e-16 |f| / h, f being C with whatever it subtracts.
/// Steps from 1e-3 to 1e-6 of the stencil's size are tried and one that agrees is enough, since a wrong gradient agrees
/// with none. With 1e-4 of the size, a right gradient passes if C changes over more than a hundredth of the size and f
/// is less than 1e7 times its change over the stencil, or it stands less than 1e7 sizes from the origin; a missing term
/// of 1 % is a hundred times too large. A gradient that vanishes at rest is measured by a thousandth of that of the
/// moved copy.
template <ElementKind Kind>
void check_gradient(const Kind& kind, const Points<Kind::num_points>& points, std::string_view label) {
  constexpr Real tolerance = 1e-4;
  constexpr std::array<Real, 4> steps{1e-4, 1e-5, 1e-3, 1e-6};
  const Real size = stencil_size<Kind::num_points>(points);
  Points<Kind::num_points> moved = points;
  for (Eigen::Index k = 0; k < moved.size(); ++k) {
    // Multiples of the golden ratio: spread evenly, no two coordinates moved alike.
    const Real phase = static_cast<Real>(k + 1) * 0.6180339887498949;
    moved.data()[k] += 0.1 * size * (2 * (phase - std::floor(phase)) - 1);
  }
  const Real typical_norm = detail::compare_gradient(kind, moved, steps[0] * size).norm;
  for (const bool at_rest : {true, false}) {
    detail::GradientComparison first;
    bool agrees = false;
    for (const Real step : steps) {
      const detail::GradientComparison worst = detail::compare_gradient(kind, at_rest ? points : moved, step * size);
      agrees = worst.error <= tolerance * std::max(worst.norm, 1e-3 * typical_norm);
      if (step == steps[0]) first = worst;
      if (agrees) break;
    }
    if (agrees) continue;
    throw std::invalid_argument(std::string(label) + (at_rest ? ": at rest, " : ": near rest, ") +
                                (Constraint<Kind> ? "dC/dp" : "dpsi/dp") + std::to_string(first.point) + "." +
                                "xyz"[first.axis] + " is " + to_text(first.given) + ", central differences give " +
                                to_text(first.differences));
  }
}

}  // namespace penalty
