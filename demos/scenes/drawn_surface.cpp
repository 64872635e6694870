#include "scenes/drawn_surface.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "penalty/contact/closest_points.h"

namespace penalty::demo {
namespace {

Real volume(const Vector3& u, const Vector3& v, const Vector3& w) { return u.cross(v).dot(w); }

/// Whether the edge pq goes through the triangle abc.
bool pierces(const Vector3& p, const Vector3& q, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Real from = volume(b - a, c - a, p - a), to = volume(b - a, c - a, q - a);
  if (!(from * to < 0)) return false;
  const Vector3 d = q - p;
  const Real u = volume(d, a - p, b - p), v = volume(d, b - p, c - p), w = volume(d, c - p, a - p);
  return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

bool has(const Triangle& triangle, int vertex) {
  return std::find(triangle.begin(), triangle.end(), vertex) != triangle.end();
}

}  // namespace

DrawnSurface::DrawnSurface(BodyMesh mesh)
    : mesh_(std::move(mesh)),
      triangles_(mesh_.drawn_triangles()),
      edges_(edges_of(std::span<const Triangle>(triangles_))),
      x_(mesh_.drawn(mesh_.vertices())) {
  std::set<int> corners;
  std::vector<Box> boxes;
  boxes.reserve(triangles_.size());
  for (const Triangle& triangle : triangles_) {
    corners.insert(triangle.begin(), triangle.end());
    boxes.push_back(box_of(triangle));
  }
  corners_.assign(corners.begin(), corners.end());
  tree_ = BoxTree(boxes);
}

Box DrawnSurface::box_of(std::span<const int> vertices) const {
  Box box;
  for (const int i : vertices) box.add(at(i));
  return box;
}

void DrawnSurface::move_to(const PackedVectors& positions) {
  x_ = mesh_.drawn(positions.topRows<3>());
  tree_.refit([this](int t) { return box_of(triangles_[t]); });
}

long DrawnSurface::crossings(const DrawnSurface& other) const {
  long count = 0;
  for (const Edge& edge : edges_)
    other.tree_.visit(box_of(edge), 0, [&](int t) {
      const Triangle& triangle = other.triangles_[t];
      if (&other == this && (has(triangle, edge[0]) || has(triangle, edge[1]))) return;
      count += pierces(at(edge[0]), at(edge[1]), other.at(triangle[0]), other.at(triangle[1]), other.at(triangle[2]));
    });
  return count;
}

Real DrawnSurface::distance(const DrawnSurface& other, Real reach) const {
  Real least = reach;
  for (const int i : corners_) {
    Box box;
    box.add(at(i));
    other.tree_.visit(box, reach, [&](int t) {
      const auto& [a, b, c] = other.triangles_[t];
      if (&other == this && (i == a || i == b || i == c)) return;
      const ClosestPoints nearest = closest_points_of_triangle(at(i), other.at(a), other.at(b), other.at(c));
      least = std::min(least, nearest.difference.norm());
    });
  }
  return least;
}

Real DrawnSurface::distance(const Vector3& point) const {
  Real least = infinite;
  for (const auto& [a, b, c] : triangles_)
    least = std::min(least, closest_points_of_triangle(point, at(a), at(b), at(c)).difference.norm());
  return least;
}

// By the solid angle under which the surface is seen: A. van Oosterom, J. Strackee, The Solid Angle of a Plane Triangle
// (1983), equation 8.
bool DrawnSurface::encloses(const Vector3& point) const {
  Real angle = 0;
  for (const auto& [i, j, k] : triangles_) {
    const Vector3 a = at(i) - point, b = at(j) - point, c = at(k) - point;
    const Real la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(volume(a, b, c), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return std::abs(angle) > 2 * std::numbers::pi;
}

bool overlap(const DrawnSurface& a, const DrawnSurface& b) {
  return a.crossings(b) + b.crossings(a) > 0 || a.encloses(b.vertices().col(0)) || b.encloses(a.vertices().col(0));
}

SurfaceWatch::SurfaceWatch(const std::vector<BodyMesh>& meshes, Real reach) : reach_(reach), least_(reach) {
  for (const BodyMesh& mesh : meshes) surfaces_.emplace_back(mesh);
}

void SurfaceWatch::see(const SceneState& state) {
  for (std::size_t b = 0; b < surfaces_.size(); ++b) surfaces_[b].move_to(state.x(b));
  for (const DrawnSurface& a : surfaces_)
    for (const DrawnSurface& b : surfaces_) {
      (&a == &b ? self_crossings_ : crossings_) += a.crossings(b);
      least_ = std::min(least_, a.distance(b, reach_));
    }
}

int SurfaceWatch::overlapping_pairs() const {
  int pairs = 0;
  for (std::size_t a = 0; a < surfaces_.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) pairs += overlap(surfaces_[a], surfaces_[b]);
  return pairs;
}

}  // namespace penalty::demo
