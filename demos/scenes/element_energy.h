// Where a body broke.
#pragma once
#include "penalty/fields/potential_field.h"
#include "scenes/body_mesh.h"

namespace penalty::demo {

/// What is left to draw of the body where lengths broke: its triangles without those that have a broken edge, or the
/// boundary of its tetrahedra without these. Empty as long as everything holds, and of an embedded surface.
std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field);

}  // namespace penalty::demo
