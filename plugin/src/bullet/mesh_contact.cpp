#include "mesh_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "penalty/contact/closest_points.h"

namespace penalty {
namespace {

constexpr Real same_distance = 1e-9;  // relative to what is measured
constexpr Real flat_height = 1e-6;    // height over a plane that is none, relative to the size of the triangle
constexpr int most_planes = 16;       // of a point and a mesh
constexpr Real mesh_slop = 1e-4,
               share_of_margin = 0.005;  // depth that does not matter [m], of a small margin this share
constexpr int bisections = 12;

ClosestPoints closest(const MeshTriangle& triangle, const Vector3& point) {
  return closest_points_of_triangle(point, triangle.a, triangle.b, triangle.c);
}

Real size_of(const MeshTriangle& triangle) {
  return std::max((triangle.b - triangle.a).norm(), (triangle.c - triangle.a).norm());
}

/// Triangles that share the nearest edge or vertex are equally near: the one that faces the point most squarely knows
/// its side, also where they meet at a sharp angle.
struct Nearest {
  const MeshTriangle* triangle = nullptr;
  ClosestPoints closest{};
  Real distance = std::numeric_limits<Real>::infinity();
  Real height = -1;      // above the plane of the triangle, either side
  int equally_near = 0;  // triangles
};

Nearest nearest_of(std::vector<MeshTriangle>& triangles, const Vector3& point) {
  Nearest nearest;
  for (MeshTriangle& triangle : triangles) {
    const ClosestPoints found = closest(triangle, point);
    const Real distance = triangle.distance = found.difference.norm();
    const Real tie = same_distance * (distance + size_of(triangle));
    if (distance > nearest.distance + tie) continue;
    const Real height = std::abs(found.difference.dot(triangle.normal));
    const bool is_tie = distance >= nearest.distance - tie;
    const int equally_near = is_tie ? nearest.equally_near + 1 : 1;
    if (is_tie && height <= nearest.height)
      nearest.equally_near = equally_near;
    else
      nearest = {&triangle, found, distance, height, equally_near};
  }
  return nearest;
}

SurfacePoint plane_at(const Vector3& surface, const Vector3& normal, const Vector3& point, Real mesh_margin) {
  return {surface + mesh_margin * normal, normal, normal.dot(point - surface) - mesh_margin};
}

// Towards the point where it is off the triangle.
Vector3 direction_to(const MeshTriangle& triangle, const Vector3& point, const Vector3& difference) {
  const Real distance = difference.norm();
  return distance > same_distance * (1 + size_of(triangle)) ? Vector3(difference / distance)
                                                            : Vector3(side_of(triangle, point) * triangle.normal);
}

bool is_behind(const MeshTriangle& triangle, const SurfacePoint& plane, Real mesh_margin) {
  const Vector3 on_plane = plane.point - mesh_margin * plane.normal;
  const Real allowed = flat_height * size_of(triangle);
  return plane.normal.dot(triangle.a - on_plane) <= allowed && plane.normal.dot(triangle.b - on_plane) <= allowed &&
         plane.normal.dot(triangle.c - on_plane) <= allowed;
}

/// Where on its way a point is nearest to a triangle, or first within `limit` of it. The distance is a convex function.
struct Approach {
  Vector3 position;
  ClosestPoints closest;
  Real distance;
};

Approach approach_of(const MeshTriangle& triangle, const Vector3& from, const Vector3& way, Real limit) {
  const auto at = [&](Real t) {
    const Vector3 x = from + t * way;
    const ClosestPoints found = closest(triangle, x);
    return Approach{x, found, found.difference.norm()};
  };
  const auto recedes = [&](const Approach& a) { return a.closest.difference.dot(way) >= 0; };
  Approach start = at(0);
  if (start.distance <= limit || recedes(start)) return start;
  Real low = 0, high = 1;
  Approach nearest = at(1);
  for (int k = 0; k < bisections && (nearest.distance <= limit || recedes(nearest)); ++k) {
    const Real middle = (low + high) / 2;
    const Approach there = at(middle);
    if (there.distance <= limit || recedes(there)) {
      high = middle;
      nearest = there;
    } else {
      low = middle;
    }
  }
  return nearest;
}

}  // namespace

void append_planes(std::vector<MeshTriangle>& triangles, const MovingPoint& point, Real mesh_margin, Real reach,
                   std::vector<SurfacePoint>& found) {
  const Vector3& x = point.position;
  const Nearest nearest = nearest_of(triangles, x);
  if (!nearest.triangle || !(nearest.distance - mesh_margin < reach)) return;
  const std::size_t begin = found.size();
  const Real margin = mesh_margin + point.margin, length = point.way.norm();
  Vector3 way = point.way;
  // Where another plane is in the way, it ends there or goes on along it.
  const auto add = [&](const Vector3& surface, const Vector3& normal) {
    found.push_back(plane_at(surface, normal, x, mesh_margin));
    const Real gap = found.back().distance - point.margin;
    const Real beyond = -std::max<Real>(gap, 0) - normal.dot(way);
    if (beyond > 0) way += beyond * normal;
  };
  add(x - nearest.closest.difference, direction_to(*nearest.triangle, x, nearest.closest.difference));
  const auto is_left = [&](const MeshTriangle& triangle) {
    return !std::any_of(found.begin() + static_cast<std::ptrdiff_t>(begin), found.end(),
                        [&](const SurfacePoint& plane) { return is_behind(triangle, plane, mesh_margin); });
  };
  std::erase_if(triangles, [&](const MeshTriangle& triangle) {
    return triangle.distance > margin + length || !is_left(triangle);
  });
  std::sort(triangles.begin(), triangles.end(),
            [](const MeshTriangle& l, const MeshTriangle& r) { return l.distance < r.distance; });
  const Real kept = margin - std::min(mesh_slop, share_of_margin * margin);
  for (const MeshTriangle& triangle : triangles) {
    if (found.size() - begin == most_planes) return;
    if (!is_left(triangle)) continue;
    const Approach hit = approach_of(triangle, x, way, kept);
    if (hit.distance >= kept && length < margin) continue;  // slow ones keep to the way that is foreseen
    const Vector3 surface = hit.position - hit.closest.difference;
    Vector3 normal = direction_to(triangle, hit.position, hit.closest.difference);
    // What it hits it will lie on, and the plane of the triangle is in nobody's way either where the point stays above
    // it; else it comes by the edge.
    const Vector3 face = side_of(triangle, x) * triangle.normal;
    const Real height = face.dot(x - triangle.a);
    const bool is_hit = hit.distance < margin || crosses(triangle, x, x + way);
    const bool may_be_face = height >= margin && (is_hit || height + face.dot(way) >= margin);
    if (may_be_face || normal.dot(x - surface) <= 0) normal = face;
    add(surface, normal);
  }
}

WayBack append_way_back(std::vector<MeshTriangle>& triangles, const Vector3& point, Real mesh_margin, Real radius,
                        std::vector<SurfacePoint>& found) {
  const Nearest nearest = nearest_of(triangles, point);
  if (!(nearest.distance <= radius)) return WayBack::too_far;
  const bool is_on_it = nearest.distance <= same_distance * (1 + size_of(*nearest.triangle));
  if (!is_on_it && nearest.height < (1 - flat_height) * nearest.distance) {  // nearest on an edge or a vertex
    const auto& w = nearest.closest.weights;
    const bool is_vertex = (w[1] == 0) + (w[2] == 0) + (w[3] == 0) == 2;
    if (nearest.equally_near <= (is_vertex ? 2 : 1)) return WayBack::around_the_rim;
  }
  const Vector3 normal = -side_of(*nearest.triangle, point) * nearest.triangle->normal;
  found.push_back(plane_at(point - nearest.closest.difference, normal, point, mesh_margin));
  return WayBack::found;
}

}  // namespace penalty
