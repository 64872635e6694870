// Triangle surfaces: cloth and balloons, and the closed skin of an embedded body.
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
  bool flipped = false;       // the surface was inside-out
};

/// Open or closed; `repair`, `volume` and `embed` want it closed.
struct TriangleSurface {
  Eigen::Matrix3Xd vertices;        // 3 x V [m]
  std::vector<Triangle> triangles;  // counter-clockwise seen from outside once repaired
  std::string source;               // file name or builder call, for messages and summaries
  SurfaceRepair repairs;
};

/// Makes `surface` closed and outward or throws. Vertices closer than merge_tolerance times the diagonal of the
/// bounding box become one (0: only equal ones), as STL files need; triangles that this collapses and vertices without
/// a triangle go, the rest keeps its order; a surface that encloses a negative volume is turned over. Refused: no
/// triangles, coordinates not finite or beyond `largest_coordinate`, indices out of range, an edge that does not belong
/// to exactly two triangles which run through it in opposite directions (the first such edge is named), an enclosed
/// volume of zero. Throws std::invalid_argument that names `surface.source`, the element and the value.
void repair(TriangleSurface& surface, Real merge_tolerance = 1e-7);

/// The volume that a closed surface encloses [m^3], positive if it is oriented outwards.
Real volume(const TriangleSurface& surface);

/// Sum of the areas of the triangles [m^2].
Real area(const TriangleSurface& surface);

}  // namespace penalty
