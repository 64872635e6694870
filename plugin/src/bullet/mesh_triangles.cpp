#include "mesh_triangles.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <algorithm>

#include "convert.h"

namespace penalty {
namespace {

class Collector final : public btTriangleCallback {
 public:
  Collector(const Box& box, std::vector<MeshTriangle>& found) : box_(box), found_(found) {}

  void processTriangle(btVector3* triangle, int, int) override {
    const Vector3 a = to_vector(triangle[0]), b = to_vector(triangle[1]), c = to_vector(triangle[2]);
    Box bounds;  // Bullet's search is coarse, that of heightfields most of all
    for (const Vector3& corner : {a, b, c}) bounds.add(corner);
    if (!bounds.overlaps(box_, 0)) return;
    const Vector3 face = (b - a).cross(c - a);
    const Real twice_area = face.norm();
    if (twice_area > 0) found_.push_back({.a = a, .b = b, .c = c, .normal = face / twice_area});
  }

 private:
  const Box& box_;
  std::vector<MeshTriangle>& found_;
};

// Nothing that anybody has made lies in this direction.
Vector3 shifted(const Vector3& point) { return point + 1e-9 * Vector3(0.617, 0.701, 0.357); }

bool is_same(const MeshTriangle& one, const MeshTriangle& other) {
  const auto has = [&](const Vector3& corner) { return corner == other.a || corner == other.b || corner == other.c; };
  return has(one.a) && has(one.b) && has(one.c);
}

}  // namespace

void append_triangles(const btConcaveShape& mesh, const Box& box, std::vector<MeshTriangle>& found) {
  // What touches the box is found, too, whatever round-off there is.
  const Vector3 pad = Vector3::Constant(1e-6 * (1 + box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs()).maxCoeff()));
  const Box padded{box.low - pad, box.high + pad};
  Collector collector(padded, found);
  mesh.processAllTriangles(&collector, to_bullet(padded.low), to_bullet(padded.high));
}

int side_of(const MeshTriangle& triangle, const Vector3& point) {
  return triangle.normal.dot(shifted(point) - triangle.a) >= 0 ? 1 : -1;
}

bool crosses(const MeshTriangle& triangle, const Vector3& from, const Vector3& to) {
  if (side_of(triangle, from) == side_of(triangle, to)) return false;
  const Vector3 p = shifted(from), way = to - from;
  const Vector3 a = triangle.a - p, b = triangle.b - p, c = triangle.c - p;
  const bool ab = way.dot(a.cross(b)) >= 0, bc = way.dot(b.cross(c)) >= 0, ca = way.dot(c.cross(a)) >= 0;
  return ab == bc && bc == ca;
}

bool crosses(const std::vector<MeshTriangle>& triangles, const Vector3& from, const Vector3& to) {
  bool is_odd = false;
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    if (!crosses(triangles[k], from, to)) continue;
    const auto end = triangles.begin() + static_cast<std::ptrdiff_t>(k);
    if (std::none_of(triangles.begin(), end, [&](const MeshTriangle& known) { return is_same(triangles[k], known); }))
      is_odd = !is_odd;
  }
  return is_odd;
}

}  // namespace penalty
