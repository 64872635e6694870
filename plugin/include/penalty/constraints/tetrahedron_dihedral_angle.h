// The angle between two faces of a tetrahedron.
#pragma once
#include <numbers>

#include "penalty/constraints/hinge.h"

namespace penalty {

/// C = beta - beta0 [rad], wrapped to (-pi, pi]: the interior angle at the edge p0 p1, between the faces p0 p1 p2 and
/// p0 p1 p3, with the sign of the volume.
///
///              p3                N_A = (p1 - p0) x (p2 - p0)
///             o                  N_B = (p3 - p0) x (p1 - p0), both into the tetrahedron
///            /
///           /  beta              beta = atan2(6 V |p1 - p0|, -N_A . N_B)
///        p0,p1 ---o  p2          (seen along the edge, p1 nearer)
///
///                                beta > 0: V > 0, orientation as in TetrahedronVolume; an inverted tetrahedron has
///                                the negative angle of its mirror image and is not at rest
///
/// Beta is theta of BendingAngle and half a turn, so gradient and Hessian are the same (detail::Hinge).
///
/// A face thinner than 1e-8 has no normal: gradient and Hessian are then zero. C jumps where the angle is half a turn
/// from rest: an inverted tetrahedron with |beta| + |beta0| < pi returns through beta = 0, any other through pi.
struct TetrahedronDihedralAngle {
  static constexpr std::string_view name = "tetrahedron dihedral angle";
  static constexpr int num_points = 4;
  static constexpr Real period = 2 * std::numbers::pi;  // of C: targets are taken the shorter way round

  /// Throws std::invalid_argument for a face at the edge that has no area.
  static TetrahedronDihedralAngle at_rest(const Points<4>& rest) {
    const detail::Hinge hinge(rest);
    hinge.require_wings(name);
    return {hinge.dihedral_angle()};
  }

  static Real angle(const Points<4>& p) { return detail::Hinge(p).dihedral_angle(); }

  Real value(const Points<4>& p) const { return detail::wrapped_difference(angle(p), rest_angle); }

  Gradient<4> gradient(const Points<4>& p) const {
    Gradient<4> g;
    detail::Hinge(p).gradient(g);
    return g;
  }

  Real value_and_gradient(const Points<4>& p, Gradient<4>& g) const {
    const detail::Hinge hinge(p);
    hinge.gradient(g);
    return detail::wrapped_difference(hinge.dihedral_angle(), rest_angle);
  }

  Hessian<4> hessian(const Points<4>& p) const { return detail::Hinge(p).hessian(); }

  Real rest_angle;  // beta0, in (-pi, pi]
};

}  // namespace penalty
