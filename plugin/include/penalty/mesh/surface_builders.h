// Surfaces made without a file: a sheet, a sphere.
#pragma once
#include "penalty/mesh/triangle_surface.h"

namespace penalty {

/// How the cells of a sheet are cut in two:
///
///     alternating  +---+---+      one_way  +---+---+
///                  | \ | / |               | / | / |
///                  +---+---+               +---+---+
///                  | / | \ |               | / | / |
///                  +---+---+               +---+---+
///
/// Alternating diagonals have no preferred direction; one way, a sheet is stiffer along them.
enum class Diagonals { alternating, one_way };

/// The open sheet [0, width] x [0, height] [m] in the plane z = 0, its front towards +z, of cells_x * cells_y cells.
/// Vertex (i, j) is number i + j (cells_x + 1), at x = width i / cells_x, y = height j / cells_y. Throws
/// std::invalid_argument, naming the argument: sizes must be positive and finite, cells at least 1 and at most 10^8
/// together.
TriangleSurface make_sheet(Real width, Real height, int cells_x, int cells_y,
                           Diagonals diagonals = Diagonals::alternating);

/// The closed sphere about the origin: an icosahedron whose edges are cut into `subdivisions` parts, 20 subdivisions^2
/// triangles and 10 subdivisions^2 + 2 vertices, all on the sphere. `subdivisions`: 1 to 250.
TriangleSurface make_sphere(Real radius, int subdivisions);

}  // namespace penalty
