// The tetrahedral mesh that soft bodies are made from, and the gate that every reader and builder ends with.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "penalty/fields/topology.h"
#include "penalty/math/types.h"

namespace penalty {

/// A file that is not a usable mesh. what() is one line: file, line, element and value, as far as they are known, e.g.
/// "bad.vtk:17: vertex 4: coordinate y is nan".
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What reading and `repair` changed.
struct MeshRepair {
  int reoriented = 0;          // left-handed tetrahedra whose last two vertices were swapped
  int dropped_vertices = 0;    // vertices that no tetrahedron mentions
  int merged_vertices = 0;     // vertices that stand where another one does
  int dropped_tetrahedra = 0;  // ones that are there already, or flat
  int split_solids = 0;        // pyramids, prisms and hexahedra that were cut into tetrahedra
  int reduced_solids = 0;      // elements of higher order that became ones of their corners
};

/// In words, e.g. "merged 4 vertices, dropped 1 tetrahedron"; empty where nothing was changed.
std::string to_text(const MeshRepair& repairs);

/// Tetrahedra or vertices that belong together under a name.
struct MeshGroup {
  std::string name;
  std::vector<int> members;  // ascending, each once, once repaired
};

struct TetMesh {
  Eigen::Matrix3Xd vertices;            // 3 x V [m]
  std::vector<Tetrahedron> tetrahedra;  // positively oriented once repaired
  std::string source;                   // file name or builder call, for messages and summaries
  MeshRepair repairs;
  std::vector<MeshGroup> regions;      // of tetrahedra: they may overlap, and leave some out
  std::vector<MeshGroup> vertex_sets;  // of vertices

  /// Members of the region or the vertex set of that name. Throw std::invalid_argument that says which there are.
  const std::vector<int>& region(std::string_view name) const;
  const std::vector<int>& vertex_set(std::string_view name) const;
};

/// Where the elements of a mesh stand in their files, for error messages. An empty list means "unknown"; without tags
/// elements are counted from 0, as in VTK files.
struct MeshOrigin {
  std::string vertex_file, tetrahedron_file;
  std::vector<int> vertex_lines, tetrahedron_lines;         // counted from 1
  std::vector<std::int64_t> vertex_tags, tetrahedron_tags;  // the numbers that the files give them
};

/// A tetrahedron of longest edge L counts as flat if 6 |V| < flat_tetrahedron * L^3; a regular one has 0.7 L^3. Its
/// height is then below a millionth of its size: no explicit step could follow its springs.
inline constexpr Real flat_tetrahedron = 1e-6;

/// Coordinates beyond this [m] are refused: their cubes would overflow.
inline constexpr Real largest_coordinate = 1e100;

/// Makes `mesh` usable or throws. Left-handed tetrahedra get their last two vertices swapped; vertices that no
/// tetrahedron mentions are dropped, the others keep their order; both are added to `mesh.repairs`. Afterwards node i
/// of a body is column i of `vertices`. Regions and vertex sets follow; those that have become empty go.
/// Refused: no tetrahedra, coordinates not finite or beyond `largest_coordinate` (unmentioned vertices too), indices
/// out of range or repeated within a tetrahedron, two tetrahedra with the same four vertices, flat tetrahedra, members of regions and vertex sets out of range.
/// Throws std::invalid_argument that names `mesh.source`, the element and the value.
void repair(TetMesh& mesh);

/// The same for a mesh from files, which other programs make as they do: vertices of tetrahedra at the same coordinates
/// become one, of tetrahedra with the same four vertices one is kept, and flat ones are dropped if they are at most one
/// in a hundred. Throws MeshError that also names file and line.
void repair(TetMesh& mesh, const MeshOrigin& origin);

/// Sum of the signed volumes [m^3].
Real volume(const TetMesh& mesh);

/// How far the elements are from regular.
struct MeshQuality {
  Real edge_ratio = 0;         // largest over the tetrahedra of longest edge / shortest edge; regular: 1
  Real smallest_dihedral = 0;  // [rad]; regular: 1.231 (70.5 degrees)
  Real largest_dihedral = 0;   // [rad]
};
MeshQuality quality(const TetMesh& mesh);

}  // namespace penalty
