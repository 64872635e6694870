// Where the surface of a collision shape is, seen from a point.
#pragma once
#include <vector>

#include "penalty/math/types.h"

class btCollisionShape;

namespace penalty {

/// The nearest point of a surface. `distance` is negative inside; `normal` points outwards. A positive `radius` says
/// that the surface is round there: it keeps this distance from point - radius * normal.
struct SurfacePoint {
  Vector3 point, normal;
  Real distance;
  Real radius = 0;
};

/// Appends the nearest surface points of `shape` to `point`, in the frame of the shape and within `reach` [m], one for
/// each convex part. In closed form for planes, spheres, boxes and capsules; by GJK and EPA for other convex shapes;
/// child by child for compounds. Triangle meshes, which have no inside, are left to MeshSides.
void append_surface_points(const btCollisionShape& shape, const Vector3& point, Real reach,
                           std::vector<SurfacePoint>& found);

}  // namespace penalty
