// Where in a body its elastic energy is, and where it broke.
#pragma once
#include "penalty/fields/potential_field.h"
#include "scenes/body_mesh.h"

namespace penalty::demo {

/// The energy of each element at positions `x`, handed down to its points in equal parts [J]; one entry a particle,
/// which add up to the energy of the field's kinds.
Eigen::VectorXd particle_energies(const PotentialField& field, const Positions& x);

/// What is left to draw of the body where lengths broke: its triangles without those that have a broken edge, or the
/// boundary of its tetrahedra without these. Empty as long as everything holds, and of an embedded surface.
std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field);

}  // namespace penalty::demo
