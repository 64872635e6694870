// The triangles of Bullet's concave shapes.
#pragma once
#include <vector>

#include "penalty/contact/box.h"

class btConcaveShape;

namespace penalty {

/// In the frame of its shape.
struct MeshTriangle {
  Vector3 a, b, c;
  Vector3 normal;     // of unit length
  Real distance = 0;  // from the point that was asked about last
};

/// Appends the triangles that may reach into the box; those without area are left out.
void append_triangles(const btConcaveShape& mesh, const Box& box, std::vector<MeshTriangle>& found);

/// On which side of the plane of the triangle the point is: 1 or -1, never on it.
int side_of(const MeshTriangle& triangle, const Vector3& point);

/// Whether the straight way between two points passes the triangle. One that grazes it, or goes through an edge or a
/// vertex, does or does not: as if all triangles were shifted a little, so that surfaces stay without holes.
bool crosses(const MeshTriangle& triangle, const Vector3& from, const Vector3& to);

/// Whether it passes an odd number of them. Two in the same place, as in meshes that are made to be seen from both
/// sides, count as one.
bool crosses(const std::vector<MeshTriangle>& triangles, const Vector3& from, const Vector3& to);

}  // namespace penalty
