// Where a body broke.
#pragma once
#include "penalty/fields/potential_field.h"
#include "scenes/body_mesh.h"

namespace penalty::demo {

/// What is left to draw of the body where elements broke: its triangles without those that they cut, or the
/// boundary of its tetrahedra without these. Empty as long as everything holds, and of an embedded surface.
std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field);

}  // namespace penalty::demo
