// The length of an edge.
#pragma once
#include <cmath>

#include "penalty/kinds/kind.h"
#include "penalty/math/triple.h"

namespace penalty {

/// C = (|p1 - p0| - L0) / L0, dimensionless (seed eq. 9).
///
///     p0 o-------o p1        n = (p1 - p0) / |p1 - p0|
///
/// Gradient: dC/dp1 = n / L0 = -dC/dp0 (seed eq. 10-13). A spring of stiffness k [N/m] is K = k L0² [J].
/// Coincident points (closer than 1e-9 L0) have no direction: n is then the direction at rest and the Hessian is zero,
/// so the force still pushes the points apart.
struct Length {
  static constexpr std::string_view name = "length";
  static constexpr int num_points = 2;

  /// Throws std::invalid_argument for a rest length that is zero or not finite.
  static Length at_rest(const Points<2>& rest) {
    const Vector3 edge = rest.col(1) - rest.col(0);
    const Real length = edge.norm();
    require_rest_value(name, "rest length", length);
    return {1 / length, (edge / length).cast<float>()};
  }

  Real rest_length() const { return 1 / inverse_rest_length; }

  Real value(const Points<2>& p) const { return (p.col(1) - p.col(0)).norm() * inverse_rest_length - 1; }

  Gradient<2> gradient(const Points<2>& p) const {
    Gradient<2> g;
    value_and_gradient(p, g);
    return g;
  }

  [[gnu::always_inline]] Real value_and_gradient(const Points<2>& p, Gradient<2>& g) const {
    Triple direction = Triple::column(p, 1) - Triple::column(p, 0);
    const Real length = std::sqrt(dot(direction, direction));
    const Real ratio = length * inverse_rest_length;
    Real scale = inverse_rest_length / length;
    if (!(ratio > smallest_ratio)) [[unlikely]] {
      direction = {rest_direction[0], rest_direction[1], rest_direction[2]};
      scale = inverse_rest_length;
    }
    direction = direction * scale;
    direction.store(g, 1);
    (-direction).store(g, 0);
    return ratio - 1;
  }

  /// [[B, -B], [-B, B]] with B = (I - n nᵀ) / (|p1 - p0| L0).
  Hessian<2> hessian(const Points<2>& p) const {
    const Vector3 edge = p.col(1) - p.col(0);
    const Real length = edge.norm();
    Hessian<2> h = Hessian<2>::Zero();
    if (length * inverse_rest_length <= smallest_ratio) return h;
    const Vector3 n = edge / length;
    const Matrix3 block = (Matrix3::Identity() - n * n.transpose()) * (inverse_rest_length / length);
    h << block, -block, -block, block;
    return h;
  }

  /// [[X, -X], [-X, X]] with X = n nᵀ / L0² + strain B: B is across n, so X has eigenvalues 1 / L0² once and
  /// strain / (|p1 - p0| L0) twice, of which only the latter can be negative.
  Hessian<2> projected_stiffness(const Points<2>& p, Real strain) const {
    Triple n = Triple::column(p, 1) - Triple::column(p, 0);
    const Real length = std::sqrt(dot(n, n));
    Real across = 0;
    if (length * inverse_rest_length > smallest_ratio) {
      const Real inverse = 1 / length;
      n = n * inverse;
      if (strain > 0) across = strain * inverse * inverse_rest_length;
    } else {
      n = {rest_direction[0], rest_direction[1], rest_direction[2]};
    }
    const Triple along = n * (inverse_rest_length * inverse_rest_length - across);
    const Real xx = along.x * n.x + across, yy = along.y * n.y + across, zz = along.z * n.z + across;
    const Real xy = along.x * n.y, yz = along.y * n.z, zx = along.z * n.x;
    Hessian<2> k;
    k << xx, xy, zx, -xx, -xy, -zx,  //
        xy, yy, yz, -xy, -yy, -yz,   //
        zx, yz, zz, -zx, -yz, -zz,   //
        -xx, -xy, -zx, xx, xy, zx,   //
        -xy, -yy, -yz, xy, yy, yz,   //
        -zx, -yz, -zz, zx, yz, zz;
    return k;
  }

  static constexpr Real smallest_ratio = 1e-9;  // of the rest length: below it the points coincide
  Real inverse_rest_length;                     // 1 / L0 [1/m]
  Eigen::Vector3f rest_direction;               // n at rest: only a direction, so single precision is enough
};

}  // namespace penalty
