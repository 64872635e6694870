// The fold of two triangles about their common edge.
#pragma once
#include <numbers>

#include "penalty/constraints/hinge.h"

namespace penalty {

/// C = theta - theta0 [rad], wrapped to (-pi, pi]: the hinge p0 p1 with wings p2 and p3; theta = 0 is flat.
///
///             p2
///            o                   N_A = (p1 - p0) x (p2 - p0), N_B = (p3 - p0) x (p1 - p0),
///           / \                  here both towards the viewer
///      p0  o---o  p1
///           \ /                  theta = atan2((N_A x N_B) . e, N_A . N_B), e the direction of p0 p1
///            o
///             p3                 theta > 0: the tips bend away from the side that the normals point to, and the
///                                tetrahedron p0 p1 p2 p3 has a negative volume
///
/// Exchanging p0 and p1, or p2 and p3, turns the sign of theta; both together keep it.
///
/// Gradient: of the tips -N/|N| over the height of the wing, of the edge such that there is no net force and no torque
/// (detail::Hinge; Bridson, Marino and Fedkiw 2003, Grinspun et al. 2003).
///
/// A wing thinner than 1e-8 has no normal: gradient and Hessian are then zero. C jumps where the angle is half a turn
/// from rest, so cloth folded through itself takes the short way back, which may be the other way round.
struct BendingAngle {
  static constexpr std::string_view name = "bending angle";
  static constexpr int num_points = 4;
  static constexpr Real period = 2 * std::numbers::pi;  // of C: targets are taken the shorter way round

  /// Any rest angle will do, 0 among them: flat cloth. Throws std::invalid_argument for a wing without an area.
  static BendingAngle at_rest(const Points<4>& rest) {
    const detail::Hinge hinge(rest);
    hinge.require_wings(name);
    return {hinge.bending_angle()};
  }

  static Real angle(const Points<4>& p) { return detail::Hinge(p).bending_angle(); }

  Real value(const Points<4>& p) const { return detail::wrapped_difference(angle(p), rest_angle); }

  Gradient<4> gradient(const Points<4>& p) const {
    Gradient<4> g;
    detail::Hinge(p).gradient(g);
    return g;
  }

  Real value_and_gradient(const Points<4>& p, Gradient<4>& g) const {
    const detail::Hinge hinge(p);
    hinge.gradient(g);
    return detail::wrapped_difference(hinge.bending_angle(), rest_angle);
  }

  Hessian<4> hessian(const Points<4>& p) const { return detail::Hinge(p).hessian(); }

  Real rest_angle;  // theta0, in (-pi, pi]
};

}  // namespace penalty
