// Central differences for kinds of any number of points.
#pragma once
#include "math/random.h"

namespace penalty::testing {

/// One entry a coordinate of `f(points)`, a scalar.
template <class Function>
Gradient<dynamic> differences_of_value(const Function& f, Points<dynamic> points, Real step) {
  Gradient<dynamic> result(3, points.cols());
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    const Real start = points.data()[k];
    points.data()[k] = start + step;
    const Real above = f(points);
    points.data()[k] = start - step;
    const Real below = f(points);
    points.data()[k] = start;
    result.data()[k] = (above - below) / (2 * step);
  }
  return result;
}

/// One column a coordinate of `f(points)`, 3 x n.
template <class Function>
Hessian<dynamic> differences_of_gradient(const Function& f, Points<dynamic> points, Real step) {
  Hessian<dynamic> result(points.size(), points.size());
  for (Eigen::Index k = 0; k < points.size(); ++k) {
    const Real start = points.data()[k];
    points.data()[k] = start + step;
    const Gradient<dynamic> above = f(points);
    points.data()[k] = start - step;
    const Gradient<dynamic> below = f(points);
    points.data()[k] = start;
    result.col(k) = (above - below).reshaped() / (2 * step);
  }
  return result;
}

/// Sum of the vectors over the sum of their lengths.
inline Real net_sum(const Gradient<dynamic>& vectors) {
  return vectors.rowwise().sum().norm() / vectors.colwise().norm().sum();
}

/// Sum of the moments over the sum of arm times length, about the origin.
inline Real net_moment(const Points<dynamic>& points, const Gradient<dynamic>& vectors) {
  Vector3 moment = Vector3::Zero();
  Real scale = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 arm = points.col(i), vector = vectors.col(i);
    moment += arm.cross(vector);
    scale += arm.norm() * vector.norm();
  }
  return moment.norm() / scale;
}

}  // namespace penalty::testing
