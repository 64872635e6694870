// The angle between two faces of a tetrahedron.
#pragma once
#include <string_view>

#include "penalty/kinds/hinge.h"

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
/// Beta is theta of BendingAngle and half a turn, so gradient and Hessian are the same (detail::FoldedEdge).
///
/// A face thinner than 1e-8 has no normal: gradient and Hessian are then zero. C jumps where the angle is half a turn
/// from rest: an inverted tetrahedron with |beta| + |beta0| < pi returns through beta = 0, any other through pi.
struct TetrahedronDihedralAngle : detail::AngleAboutEdge<TetrahedronDihedralAngle> {
  static constexpr std::string_view name = "tetrahedron dihedral angle";
  static Real angle_of(const detail::FoldedEdge& edge) { return edge.dihedral_angle(); }
};

}  // namespace penalty
