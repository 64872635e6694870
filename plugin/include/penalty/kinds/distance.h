// The distance of a point from a place that is no particle.
#pragma once
#include <cmath>

#include "penalty/kinds/kind.h"
#include "penalty/math/triple.h"

namespace penalty {

/// C = (|p - q| - d0) / d0, dimensionless: a spring from the point p to the target q, which is fixed or moved by the
/// program at run time. `pinned` has d0 = 0 and C = |p - q| / length instead: E = K/2 |p - q|² / length², a spring of
/// K / length² [N/m] in every direction.
///
/// Gradient: dC/dp = n / d0 (n / length), n = (p - q) / |p - q|: that of Length, seed eq. 10-13, with one end held.
///
/// Coincident points (p = q; closer than 1e-9 d0 where there is a d0) have no direction: n is then that at rest and the
/// Hessian is zero. Of a pinned point C = 0 there, so there is no force; n is the x axis, which gives the Gauss-Newton
/// stiffness its K / length².
struct Distance {
  static constexpr std::string_view name = "distance";
  static constexpr int num_points = 1;
  /// The force has its reaction outside of the particles, in whatever holds the target.
  static constexpr bool conserves_momentum = false;

  /// A prototype, which has no force yet: its `at_rest` freezes the distance. Throws std::invalid_argument for a target
  /// that is not finite.
  static Distance to(const Vector3& target) {
    require_finite(target);
    return {target, 0, 0, Eigen::Vector3f::UnitX()};
  }

  static Distance example(Real size) { return to(Vector3::Constant(size)); }

  /// The same with its target elsewhere.
  Distance moved(const Matrix3& rotation, const Vector3& translation) const {
    Distance kind = *this;
    kind.target = rotation * target + translation;
    return kind;
  }

  /// Holds the point at the target; `length` [m] is the distance where C = 1. Throws std::invalid_argument for a target
  /// that is not finite and a length that is not positive and finite.
  static Distance pinned(const Vector3& target, Real length) {
    require_finite(target);
    if (!(length > 0) || length - length != 0)
      throw std::invalid_argument(std::string(name) + ": length is " + to_text(length) +
                                  ", must be positive and finite");
    return {target, 1 / length, 0, Eigen::Vector3f::UnitX()};
  }

  /// The same target with d0 = |rest - target|; a pinned point stays pinned. Throws std::invalid_argument for a rest
  /// distance that is zero or not finite.
  Distance at_rest(const Points<1>& rest) const {
    if (inverse_length > 0 && rest_value == 0) return *this;
    const Vector3 offset = rest - target;
    const Real distance = offset.norm();
    require_rest_value(name, "rest distance", distance);
    return {target, 1 / distance, 1, (offset / distance).cast<float>()};
  }

  Real rest_distance() const { return rest_value > 0 ? rest_value / inverse_length : 0; }

  Real value(const Points<1>& p) const { return (p - target).norm() * inverse_length - rest_value; }

  Gradient<1> gradient(const Points<1>& p) const {
    Gradient<1> g;
    value_and_gradient(p, g);
    return g;
  }

  Real value_and_gradient(const Points<1>& p, Gradient<1>& g) const {
    Triple direction = Triple::column(p, 0) - Triple::column(target, 0);
    const Real distance = std::sqrt(dot(direction, direction));
    Real scale = inverse_length / distance;
    if (coincide(distance)) [[unlikely]] {
      direction = {rest_direction[0], rest_direction[1], rest_direction[2]};
      scale = inverse_length;
    }
    (direction * scale).store(g, 0);
    return distance * inverse_length - rest_value;
  }

  /// (I - n nᵀ) / (|p - q| d0), of a pinned point over (|p - q| length).
  Hessian<1> hessian(const Points<1>& p) const {
    const Vector3 offset = p - target;
    const Real distance = offset.norm();
    if (coincide(distance)) return Hessian<1>::Zero();
    const Vector3 n = offset / distance;
    return (Matrix3::Identity() - n * n.transpose()) * (inverse_length / distance);
  }

  static constexpr Real smallest_ratio = 1e-9;  // of the rest distance: below it the points coincide
  Vector3 target;                               // q [m]; may be changed at any time
  Real inverse_length;                          // 1 / d0, or 1 / length of a pinned point [1/m]; 0 in a prototype
  Real rest_value;                              // d0 / d0 = 1, or 0 of a pinned point
  Eigen::Vector3f rest_direction;               // n at rest: only a direction, so single precision is enough

 private:
  static void require_finite(const Vector3& target) {
    for (int k = 0; k < 3; ++k)
      if (target[k] - target[k] != 0)
        throw std::invalid_argument(std::string(name) + ": coordinate " + std::to_string(k) + " of the target is " +
                                    to_text(target[k]));
  }
  // A pinned point has a force at any distance but zero, where C d²C stays finite.
  bool coincide(Real distance) const { return !(distance * inverse_length > smallest_ratio * rest_value); }
};

}  // namespace penalty
