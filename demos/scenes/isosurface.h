// Level surfaces of a function of space.
#pragma once
#include <functional>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty::demo {

struct Isosurface {
  Eigen::Matrix3Xd vertices;
  std::vector<Triangle> triangles;  // counter-clockwise seen from where the function is larger
};

using SpaceFunction = std::function<Real(const Vector3&)>;

/// The surface f = level in the box from `low` to `high`, by marching tetrahedra: `cells` cubes along the longest side,
/// six tetrahedra each. Vertices lie on f = level to a millionth of a cell; the triangles between them are off by the
/// square of a cell times the curvature. Closed where it does not leave the box. A value of f that is not finite counts
/// as outside.
Isosurface isosurface(const SpaceFunction& f, Real level, const Vector3& low, const Vector3& high, int cells);

/// The part of `surface` where `keep` <= 0. Triangles across its border are cut along a straight line.
Isosurface clipped(const Isosurface& surface, const SpaceFunction& keep);

/// Unit normals of the vertices, from their triangles alone: means of u x v / (|u|² |v|²), u and v the sides that meet
/// in the vertex (Max 1999). Exact on a sphere, whatever the triangles.
Eigen::Matrix3Xd normals(const Isosurface& surface);

}  // namespace penalty::demo
