// Which planes keep a point from crossing the triangles near it.
#pragma once
#include <vector>

#include "mesh_triangles.h"
#include "surface_distance.h"

namespace penalty {

/// A point of a soft body that is on its way, in the frame of a mesh.
struct MovingPoint {
  Vector3 position = Vector3::Zero();
  Vector3 way = Vector3::Zero();  // that it will go in the step, left to itself [m]
  Real margin = 0;                // that it keeps [m], beyond that of the mesh
};

/// Appends planes between the point and the triangles, lifted by `mesh_margin` [m]: that of the nearest triangle if its
/// surface is within `reach` [m], and as many as it takes so that the point may not come to another that is within
/// reach either, but for those that lie behind the others or are out of its way. Triangles have two sides: the point
/// stays on that where it is. Leaves `triangles` in disorder.
void append_planes(std::vector<MeshTriangle>& triangles, const MovingPoint& point, Real mesh_margin, Real reach,
                   std::vector<SurfacePoint>& found);

enum class WayBack { found, too_far, around_the_rim };

/// Appends the plane that leads a point which is on the wrong side of the nearest triangle back through that, if it is
/// within `radius` [m] and the point has not left that side around the rim of the mesh.
WayBack append_way_back(std::vector<MeshTriangle>& triangles, const Vector3& point, Real mesh_margin, Real radius,
                        std::vector<SurfacePoint>& found);

}  // namespace penalty
