// Does a triangle touch a tetrahedron? By separating axes.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// True if the closed triangle and the closed tetrahedron have a point in common, or would have if one of them grew by
/// `slack` [m]: touching counts, and rounding must not decide it. A triangle without area is its longest side.
bool triangle_touches_tetrahedron(const Points<3>& triangle, const Points<4>& tetrahedron, Real slack);

}  // namespace penalty
