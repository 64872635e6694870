// The list of kinds. A new kind is its header and one line here: the property tests run over it.
#pragma once
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/corner_angle.h"
#include "penalty/kinds/distance.h"
#include "penalty/kinds/length.h"
#include "penalty/kinds/tetrahedron_dihedral_angle.h"
#include "penalty/kinds/tetrahedron_volume.h"
#include "penalty/kinds/triangle_area.h"

namespace penalty {

template <class... Kinds>
struct KindList {};

using AllKinds =
    KindList<Length, TriangleArea, TetrahedronVolume, CornerAngle, TetrahedronDihedralAngle, BendingAngle, Distance>;

}  // namespace penalty
