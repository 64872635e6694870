// Meshes made without a file: box, ball, solid torus.
#pragma once
#include <array>

#include "penalty/mesh/tet_mesh.h"

namespace penalty {

/// Into how many tetrahedra a cell of a box is cut. `five`: one in the middle and four corners, mirrored from cell to
/// cell so that faces match. `six`: around the diagonal from the lowest to the highest corner (Kuhn), all cells alike.
enum class BoxSplit { five, six };

/// The box [0, size.x] x [0, size.y] x [0, size.z] [m] of cells.x * cells.y * cells.z cells, cut into tetrahedra.
/// Vertices are numbered slice by slice across the direction of most cells (x before y before z if equal): neighbours
/// in space are then at most one slice apart in memory.
/// Throws std::invalid_argument, naming the argument: sizes must be positive and finite, cells at least 1 and at most
/// 10^8 together.
TetMesh make_box(const Vector3& size, const std::array<int, 3>& cells, BoxSplit split = BoxSplit::five);

/// The reference beam: a box 4 x 1 x 1 m of 4n x n x n cells; n = 4, 8, 14, 17 give "1k", "10k", "50k", "100k".
TetMesh make_beam(int cells_across);

/// A ball about the origin, 20 layers^3 tetrahedra: the 20 tetrahedra between the centre and the faces of an
/// icosahedron, each cut into layers^3 and bent so that every layer lies on a sphere; numbered layer by layer from the
/// centre, vertex 0. Edge ratio below 2, dihedral angles between 38 and 132 degrees. `layers`: 1 to 100.
TetMesh make_ball(Real radius, int layers);

/// A solid torus about the origin, its axis y: it lies flat if gravity is -y. `major_radius` from the axis to the
/// middle of the tube, `minor_radius` of the tube [m], minor < major. The disc of the tube is `layers` rings of
/// triangles about its middle, swept in `segments` steps: 18 layers^2 segments tetrahedra, (1 + 3 layers (layers + 1))
/// segments vertices. The defaults are 2 m across: 4 374 tetrahedra, 999 vertices, edge ratio at most 1.87, dihedral
/// angles between 39 and 108 degrees. Elements stay that good while a segment is about as long as 1 to 1.6 rings are
/// thick in the middle of the tube. `layers`: 1 to 200; `segments`: 3 to 100 000; at most 10^8 tetrahedra.
TetMesh make_torus(Real major_radius = 0.7, Real minor_radius = 0.3, int layers = 3, int segments = 27);

}  // namespace penalty
