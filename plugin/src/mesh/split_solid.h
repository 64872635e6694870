// Pyramids, prisms and hexahedra cut into tetrahedra.
#pragma once
#include <span>
#include <vector>

#include "penalty/fields/topology.h"
#include "raw_mesh.h"

namespace penalty {

/// Appends the tetrahedra of a solid to `tetrahedra`: those that join its corner of least index to the faces that do not
/// have it, where quadrilaterals are cut along the diagonal from their own corner of least index. So solids that share
/// a face cut it the same way (Dompierre et al. 1999, "How to subdivide pyramids, prisms and hexahedra into
/// tetrahedra"). What collapsed, because corners are used twice, is left out. Each has a positive volume, or none.
void split(Solid solid, std::span<const int> corners, const Eigen::Matrix3Xd& vertices,
           std::vector<Tetrahedron>& tetrahedra);

}  // namespace penalty
