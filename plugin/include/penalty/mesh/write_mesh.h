// Writes tetrahedral meshes as VTK legacy files.
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "penalty/mesh/tet_mesh.h"

namespace penalty {

/// One number a vertex or a tetrahedron, under a name without white space.
struct MeshScalars {
  std::string name;
  std::span<const Real> values;
};

/// Writes `mesh` as VTK legacy ASCII 3.0, coordinates in the fewest digits from which reading the file gives the
/// same doubles back.
/// Throws std::invalid_argument if a scalar field has the wrong length or a bad name, MeshError if the file cannot be
/// written.
void write_vtk(const std::filesystem::path& path, const TetMesh& mesh, std::span<const MeshScalars> vertex_scalars = {},
               std::span<const MeshScalars> tetrahedron_scalars = {});

}  // namespace penalty
