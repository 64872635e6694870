// Two points held at their rest distance, zero included: what ties bodies to each other.
#pragma once
#include "penalty/kinds/distance.h"

namespace penalty {

/// C = (|p1 - p0| - d0) / length, dimensionless: a spring of K / length² [N/m]. Unlike Length, it may have no length at
/// rest: two points that coincide then stay together, with the same stiffness in every direction.
///
/// Gradient: dC/dp1 = n / length = -dC/dp0, n = (p1 - p0) / |p1 - p0|: Distance with p0 for its target, which takes the
/// reaction. Coincident points are as there.
struct Attachment {
  static constexpr std::string_view name = "attachment";
  static constexpr int num_points = 2;
  static constexpr bool rests_in_one_place = true;

  /// A prototype: `length` [m] is the stretch at which C = 1. Throws std::invalid_argument unless it is positive and
  /// finite.
  static Attachment of_length(Real length) {
    if (!(length > 0) || length - length != 0)
      throw std::invalid_argument(std::string(name) + ": length is " + to_text(length) +
                                  ", must be positive and finite");
    return {1 / length, 0, Eigen::Vector3f::UnitX()};
  }

  static Attachment example(Real size) { return of_length(0.4 * size); }

  /// The one with d0 = |rest1 - rest0|. Throws std::invalid_argument for a rest distance that is not finite.
  Attachment at_rest(const Points<2>& rest) const {
    const Vector3 offset = rest.col(1) - rest.col(0);
    const Real distance = offset.norm();
    if (distance - distance != 0)
      throw std::invalid_argument(std::string(name) + ": rest distance is " + to_text(distance));
    Attachment attachment = *this;
    attachment.rest_value = distance * inverse_length;
    if (distance > 0) attachment.rest_direction = (offset / distance).cast<float>();
    return attachment;
  }

  Real value(const Points<2>& p) const { return to_first(p).value(p.col(1)); }

  Gradient<2> gradient(const Points<2>& p) const {
    Gradient<2> g;
    value_and_gradient(p, g);
    return g;
  }

  Real value_and_gradient(const Points<2>& p, Gradient<2>& g) const {
    Gradient<1> of_second;
    const Real c = to_first(p).value_and_gradient(p.col(1), of_second);
    g << -of_second, of_second;
    return c;
  }

  Hessian<2> hessian(const Points<2>& p) const {
    const Matrix3 block = to_first(p).hessian(p.col(1));
    Hessian<2> h;
    h << block, -block, -block, block;
    return h;
  }

  Real inverse_length;             // 1 / length [1/m]
  Real rest_value;                 // d0 / length
  Eigen::Vector3f rest_direction;  // n at rest

 private:
  Distance to_first(const Points<2>& p) const { return {p.col(0), inverse_length, rest_value, rest_direction}; }
};

}  // namespace penalty
