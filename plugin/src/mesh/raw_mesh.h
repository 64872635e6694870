// What the readers of the formats share: elements as the file lists them, on their way to a TetMesh.
#pragma once
#include <array>
#include <filesystem>
#include <vector>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty {

struct RawMesh {
  std::vector<Real> coordinates;                        // x y z of each vertex
  std::vector<std::array<std::int64_t, 4>> tetrahedra;  // vertex tags, or indices if there are no vertex tags
  MeshOrigin origin;

  /// Reads x y z, the coordinates of the next vertex.
  void add_vertex(TextCursor& text);
  /// Reads four corners of the next tetrahedron.
  void add_tetrahedron(TextCursor& text, std::int64_t tag);

  /// Turns tags into indices and repairs. Throws MeshError.
  TetMesh finish(std::string source) &&;
};

TetMesh read_vtk(const std::filesystem::path& path);
TetMesh read_gmsh(const std::filesystem::path& path);
TetMesh read_tetgen(const std::filesystem::path& node_path, const std::filesystem::path& ele_path,
                    const std::filesystem::path& source);

}  // namespace penalty
