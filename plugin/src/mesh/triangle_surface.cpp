#include "penalty/mesh/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"
#include "point_grid.h"

namespace penalty {
namespace {

[[noreturn]] void fail(const TriangleSurface& surface, const std::string& text) {
  throw std::invalid_argument((surface.source.empty() ? "surface" : surface.source) + ": " + text);
}

void check(const TriangleSurface& surface) {
  const auto vertices = surface.vertices.cols();
  for (Eigen::Index v = 0; v < vertices; ++v)
    for (int axis = 0; axis < 3; ++axis)
      if (const Real x = surface.vertices(axis, v); !std::isfinite(x) || std::abs(x) > largest_coordinate)
        fail(surface, "vertex " + std::to_string(v) + ": coordinate " + "xyz"[axis] + " is " + to_text(x));
  if (surface.triangles.empty()) fail(surface, "the surface has no triangles");
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    for (int v : surface.triangles[i])
      if (v < 0 || v >= vertices)
        fail(surface, "triangle " + std::to_string(i) + ": vertex index " + std::to_string(v) + " is outside 0 to " +
                          std::to_string(vertices - 1));
}

// Each vertex that lies on an earlier one is replaced by it.
void merge_vertices(TriangleSurface& surface, Real merge_tolerance) {
  const Vector3 low = surface.vertices.rowwise().minCoeff(), high = surface.vertices.rowwise().maxCoeff();
  const Real diagonal = (high - low).stableNorm();
  // Equal points are closer than any positive reach.
  const Real reach = std::max(merge_tolerance * diagonal, std::numeric_limits<Real>::min() * 0x1p500);
  PointGrid kept(low, reach);
  std::vector<int> merged(static_cast<std::size_t>(surface.vertices.cols()));
  for (std::size_t v = 0; v < merged.size(); ++v) {
    const Vector3 p = surface.vertices.col(static_cast<Eigen::Index>(v));
    merged[v] = kept.nearby(p);
    if (merged[v] < 0)
      kept.add(p, merged[v] = static_cast<int>(v));
    else
      ++surface.repairs.merged_vertices;
  }
  std::vector<Triangle> triangles;
  triangles.reserve(surface.triangles.size());
  for (const Triangle& t : surface.triangles) {
    const Triangle m{merged[t[0]], merged[t[1]], merged[t[2]]};
    if (m[0] != m[1] && m[1] != m[2] && m[2] != m[0])
      triangles.push_back(m);
    else
      ++surface.repairs.dropped_triangles;
  }
  surface.triangles = std::move(triangles);
  if (surface.triangles.empty()) fail(surface, "all triangles have a repeated corner");
}

void drop_unused_vertices(TriangleSurface& surface) {
  std::vector<int> new_index(static_cast<std::size_t>(surface.vertices.cols()), -1);
  for (const Triangle& t : surface.triangles)
    for (int v : t) new_index[v] = 0;
  int kept = 0;
  for (std::size_t v = 0; v < new_index.size(); ++v)
    if (new_index[v] == 0) {
      surface.vertices.col(kept) = surface.vertices.col(static_cast<Eigen::Index>(v)).eval();
      new_index[v] = kept++;
    }
  surface.repairs.dropped_vertices = static_cast<int>(new_index.size()) - kept - surface.repairs.merged_vertices;
  surface.vertices.conservativeResize(Eigen::NoChange, kept);
  for (Triangle& t : surface.triangles)
    for (int& v : t) v = new_index[v];
}

// A use of an edge by a triangle, `forward` if it runs from the lower vertex to the higher.
struct EdgeUse {
  Edge edge;
  int triangle;
  bool forward;
};

void check_closed(const TriangleSurface& surface) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * surface.triangles.size());
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles[i][k], b = surface.triangles[i][(k + 1) % 3];
      uses.push_back({{std::min(a, b), std::max(a, b)}, static_cast<int>(i), a < b});
    }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& l, const EdgeUse& r) {
    return std::tie(l.edge, l.triangle) < std::tie(r.edge, r.triangle);
  });
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
    const std::size_t count = end - i;
    const auto corner = [&](int v) {
      std::string place = "vertex (";
      for (int axis = 0; axis < 3; ++axis)
        place.append(axis > 0 ? ", " : "").append(to_text(surface.vertices(axis, v)));
      return place.append(")");
    };
    const std::string edge = "the edge from " + corner(uses[i].edge[0]) + " to " + corner(uses[i].edge[1]);
    if (count == 1) fail(surface, "the surface is open: " + edge + " belongs to one triangle only");
    if (count > 2)
      fail(surface, "the surface branches: " + edge + " belongs to " + std::to_string(count) + " triangles");
    if (uses[i].forward == uses[i + 1].forward)
      fail(surface, "neighbouring triangles face opposite sides: both run through " + edge + " in the same direction");
    i = end;
  }
}

}  // namespace

void repair(TriangleSurface& surface, Real merge_tolerance) {
  if (!(merge_tolerance >= 0) || merge_tolerance >= 1)
    throw std::invalid_argument("repair: merge_tolerance is " + to_text(merge_tolerance) + ", not between 0 and 1");
  surface.repairs = {};
  check(surface);
  merge_vertices(surface, merge_tolerance);
  drop_unused_vertices(surface);
  check_closed(surface);
  const Real enclosed = volume(surface);
  const Vector3 box = surface.vertices.rowwise().maxCoeff() - surface.vertices.rowwise().minCoeff();
  if (!(std::abs(enclosed) > 1e-12 * std::pow(box.maxCoeff(), 3)))
    fail(surface, "the surface encloses a volume of " + to_text(enclosed));
  if (enclosed < 0) {
    for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
    surface.repairs.flipped = true;
  }
}

Real volume(const TriangleSurface& surface) {
  if (surface.vertices.cols() == 0) return 0;
  const Vector3 origin = surface.vertices.col(0);  // near the surface: far from it the sum would cancel
  Real six_volumes = 0;
  for (const Triangle& t : surface.triangles) {
    const Vector3 a = surface.vertices.col(t[0]) - origin, b = surface.vertices.col(t[1]) - origin,
                  c = surface.vertices.col(t[2]) - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

Real area(const TriangleSurface& surface) {
  Real sum = 0;
  for (Real a : areas_of(surface.vertices, surface.triangles)) sum += a;
  return sum;
}

}  // namespace penalty
