// What the readers of the formats share: elements as the file lists them, on their way to a TetMesh.
#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <vector>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty {

/// Groups by name, as a file fills them, in the order in which their names came up.
class RawGroups {
 public:
  /// The number of the group of that name, made if there is none.
  std::size_t group(const std::string& name);
  void put(std::size_t group, std::int64_t member) { groups_[group].members.push_back(member); }

  struct Group {
    std::string name;
    std::vector<std::int64_t> members;
  };
  const std::vector<Group>& groups() const { return groups_; }

 private:
  std::vector<Group> groups_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
};

/// Solid elements by the corners that they have.
enum class Solid : std::uint8_t { tetrahedron = 4, pyramid = 5, prism = 6, hexahedron = 8 };

class RawMesh {
 public:
  std::vector<Real> coordinates;  // x y z of each vertex
  MeshOrigin origin;              // tags of vertices only if the file has some
  RawGroups regions;              // of solids, by their number in the order of `add`
  RawGroups vertex_sets;          // of vertices, by tag as in `add`

  /// Reads x y z, the coordinates of the next vertex.
  void add_vertex(TextCursor& text);

  /// `corners` are tags of vertices, or indices if there are no tags; a hexahedron lists two opposite faces, each going
  /// round, a prism likewise, a pyramid its base. Without a `line` it is not known.
  void add(Solid solid, std::span<const std::int64_t> corners, std::int64_t tag, int line = 0);

  std::int64_t num_solids() const { return static_cast<std::int64_t>(solids_.size()); }

  /// A solid was of higher order: what it has beside corners is left out.
  void count_reduced() { ++reduced_; }

  /// A point, a line or a face was left out.
  void count_skipped() { ++skipped_; }

  /// Turns tags into indices, splits solids into tetrahedra so that those on both sides of a face agree, and repairs.
  /// Throws MeshError.
  TetMesh finish(std::string source) &&;

 private:
  std::vector<Solid> solids_;
  std::vector<std::int64_t> corners_;  // of all solids
  int reduced_ = 0, skipped_ = 0;
};

TetMesh read_vtk(const std::filesystem::path& path);
TetMesh read_vtk_xml(const std::string& file, std::string_view contents);
TetMesh read_gmsh(const std::filesystem::path& path);
TetMesh read_tetgen(const std::filesystem::path& node_path, const std::filesystem::path& ele_path,
                    const std::filesystem::path& source);

}  // namespace penalty
