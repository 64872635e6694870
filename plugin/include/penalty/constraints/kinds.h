// The list of kinds. A new kind is its header and one line here: the property tests run over it.
#pragma once
#include "penalty/constraints/bending_angle.h"
#include "penalty/constraints/corner_angle.h"
#include "penalty/constraints/distance.h"
#include "penalty/constraints/length.h"
#include "penalty/constraints/tetrahedron_dihedral_angle.h"
#include "penalty/constraints/tetrahedron_volume.h"
#include "penalty/constraints/triangle_area.h"

namespace penalty {

template <class... Kinds>
struct KindList {};

using AllKinds =
    KindList<Length, TriangleArea, TetrahedronVolume, CornerAngle, TetrahedronDihedralAngle, BendingAngle, Distance>;

}  // namespace penalty
