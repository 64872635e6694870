// Triangle surfaces: cloth and balloons, and the skin of an embedded body.
#pragma once
#include <string>
#include <vector>

#include "penalty/fields/topology.h"
#include "penalty/math/types.h"

namespace penalty {

/// What `repair` changed.
struct SurfaceRepair {
  int merged_vertices = 0;    // vertices that lay on an earlier one
  int dropped_vertices = 0;   // vertices that no triangle mentions
  int dropped_triangles = 0;  // triangles that lost a corner when vertices were merged
  int doubled_triangles = 0;  // triangles that were there already, whichever way round
  int turned_triangles = 0;   // triangles that faced another side than their neighbours
  bool flipped = false;       // the surface was closed and inside-out
};

/// One line; empty if nothing was changed.
std::string to_text(const SurfaceRepair& repairs);

/// Open or closed, in one or several pieces.
struct TriangleSurface {
  Eigen::Matrix3Xd vertices;        // 3 x V [m]
  std::vector<Triangle> triangles;  // counter-clockwise seen from outside once repaired
  std::string source;               // file name or builder call, for messages and summaries
  SurfaceRepair repairs;
};

/// Vertices closer than merge_tolerance times the diagonal of the bounding box become one (0: only equal ones), as STL
/// files need; triangles that this collapses, doubled ones and vertices without a triangle go, the rest keeps its order.
/// Neighbours come to face the same side, that of most of their piece; a closed surface that encloses a negative volume
/// is turned over. Refused: no triangles, coordinates not finite or beyond `largest_coordinate`, indices out of range.
/// Throws std::invalid_argument that names `surface.source`, the element and the value.
void repair(TriangleSurface& surface, Real merge_tolerance = 1e-7);

/// Throws std::invalid_argument unless every edge belongs to two triangles that run through it in opposite directions,
/// naming the first that does not, and the surface encloses a volume.
void check_closed(const TriangleSurface& surface);

/// How the triangles hang together.
struct SurfaceTopology {
  int pieces = 0;           // joined by vertices
  int open_edges = 0;       // of one triangle
  int branching_edges = 0;  // of more than two
  int opposed_edges = 0;    // of two that face opposite sides: of a Moebius strip one is left
  bool is_closed() const { return open_edges == 0 && branching_edges == 0 && opposed_edges == 0; }
};
SurfaceTopology topology_of(const TriangleSurface& surface);

/// How much of a solid's skin the surface is: the mean over its area of the winding number beside it, on the side where
/// that is greater. 1 of what is closed, near it with small holes, 1/2 of a flat sheet.
Real enclosure(const TriangleSurface& surface);

/// Pieces that are joined by vertices, in the order of their first triangles, each with those that lie inside it: shells
/// of cavities belong to the body around them. Vertices of no triangle go.
std::vector<TriangleSurface> pieces_of(const TriangleSurface& surface);

/// The volume that a closed surface encloses [m^3], positive if it is oriented outwards.
Real volume(const TriangleSurface& surface);

/// Sum of the areas of the triangles [m^2].
Real area(const TriangleSurface& surface);

}  // namespace penalty
