// The fold of two triangles about their common edge.
#pragma once
#include <string_view>

#include "penalty/kinds/hinge.h"

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
/// Any rest angle will do, 0 among them: flat cloth. Exchanging p0 and p1, or p2 and p3, turns the sign of theta; both
/// together keep it.
///
/// Gradient: of the tips -N/|N| over the height of the wing, of the edge such that there is no net force and no torque
/// (detail::FoldedEdge; Bridson, Marino and Fedkiw 2003, Grinspun et al. 2003).
///
/// A wing thinner than 1e-8 has no normal: gradient and Hessian are then zero. C jumps where the angle is half a turn
/// from rest, so cloth folded through itself takes the short way back, which may be the other way round.
struct BendingAngle : detail::AngleAboutEdge<BendingAngle> {
  static constexpr std::string_view name = "bending angle";
  static Real angle_of(const detail::FoldedEdge& edge) { return edge.bending_angle(); }
};

}  // namespace penalty
