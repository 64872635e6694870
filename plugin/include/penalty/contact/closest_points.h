// Where two features of surfaces are nearest.
#pragma once
#include <array>

#include "penalty/math/types.h"

namespace penalty {

/// The closest points of two features that have four points p between them: sum_k w_k p_k is the way from the point of
/// the second to that of the first. Weights of the first are not negative and sum to one, those of the second to minus one.
struct ClosestPoints {
  std::array<Real, 4> weights;
  Vector3 difference;  // [m]
  bool is_interior;    // both points lie inside their features, not on an end or a side
};

/// Of the point p and the triangle abc, points in this order: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
/// A triangle without area is its longest side.
ClosestPoints closest_points_of_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Of the edges p1 q1 and p2 q2, points in this order: ibid., 5.1.9. Nearly parallel edges are not nearest in their
/// interior: their ends are as near to the other's triangles. An edge without length is its first point.
ClosestPoints closest_points_of_edges(const Vector3& p1, const Vector3& q1, const Vector3& p2, const Vector3& q2);

}  // namespace penalty
