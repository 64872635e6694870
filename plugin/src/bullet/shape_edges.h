// Corners and edges of Bullet's shapes: what of them touches between the nodes of a soft body.
#pragma once
#include <vector>

#include "penalty/contact/box.h"
#include "penalty/fields/topology.h"

class btCollisionShape;

namespace penalty {

/// The box around a box that is turned and then moved.
Box transformed(const Box& box, const Matrix3& rotation, const Vector3& origin);

/// In the frame of the shape, which reaches `radius` [m] beyond each. An edge from a corner to itself is the corner alone:
/// the centre of a ball.
struct ShapeEdges {
  Real radius = 0;
  std::vector<Vector3> points = {};
  std::vector<Edge> edges = {};

  /// Whether one of them comes into the box, which is in the frame of the shape.
  bool reach_into(const Box& box) const;
};

/// One for each radius; of a concave shape what is in `box`, which is in its frame. Curved edges are polygons. A plane has
/// none.
std::vector<ShapeEdges> edges_of(const btCollisionShape& shape, const Box& box);

/// Numbers that are others when corners and edges may be; of a concave shape, see `is_concave`, those in `box`.
std::vector<Real> fingerprint_of(const btCollisionShape& shape, const Box& box);

/// It, or a part of it, is of triangles.
bool is_concave(const btCollisionShape& shape);

}  // namespace penalty
