#include "overlap.h"

#include <algorithm>

namespace penalty {
namespace {

// Two convex bodies are apart exactly if they are apart along a face normal of one or a cross product of an edge of
// each.
bool apart_along(const Vector3& axis, const Points<3>& triangle, const Points<4>& tetrahedron, Real slack) {
  const Eigen::Matrix<Real, 1, 3> s = axis.transpose() * triangle;
  const Eigen::Matrix<Real, 1, 4> t = axis.transpose() * tetrahedron;
  const Real gap = std::max(s.minCoeff() - t.maxCoeff(), t.minCoeff() - s.maxCoeff());
  return gap > 0 && gap * gap > slack * slack * axis.squaredNorm();
}

}  // namespace

bool triangle_touches_tetrahedron(const Points<3>& triangle, const Points<4>& tetrahedron, Real slack) {
  // The boxes first: they are cheap, and most pairs are far apart.
  const Vector3 gap = (triangle.rowwise().minCoeff() - tetrahedron.rowwise().maxCoeff())
                          .cwiseMax(tetrahedron.rowwise().minCoeff() - triangle.rowwise().maxCoeff());
  if (gap.maxCoeff() > slack) return false;
  // Near the origin, so that rounding is relative to the size of the two and not to where they are.
  const Vector3 origin = tetrahedron.col(0);
  const Points<3> s = triangle.colwise() - origin;
  const Points<4> t = tetrahedron.colwise() - origin;
  const Vector3 sides[3] = {s.col(1) - s.col(0), s.col(2) - s.col(1), s.col(0) - s.col(2)};
  const Vector3 edges[6] = {t.col(1) - t.col(0), t.col(2) - t.col(0), t.col(3) - t.col(0),
                            t.col(2) - t.col(1), t.col(3) - t.col(1), t.col(3) - t.col(2)};
  const Vector3 normal = sides[0].cross(sides[1]);
  if (apart_along(normal, s, t, slack)) return false;
  constexpr int faces[4][2] = {{0, 1}, {0, 2}, {1, 2}, {3, 4}};  // two edges of each face
  for (auto [a, b] : faces)
    if (apart_along(edges[a].cross(edges[b]), s, t, slack)) return false;
  for (const Vector3& side : sides) {
    if (apart_along(side.cross(normal), s, t, slack))
      return false;  // within the plane, for tetrahedra that are flat to it
    for (const Vector3& edge : edges)
      if (apart_along(side.cross(edge), s, t, slack)) return false;
  }
  return true;
}

}  // namespace penalty
