#include "penalty/mesh/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <tuple>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"
#include "point_grid.h"
#include "surface_pieces.h"

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

void drop_doubled_triangles(TriangleSurface& surface) {
  std::set<Triangle> known;
  const auto doubled = std::erase_if(surface.triangles, [&known](Triangle t) {
    std::sort(t.begin(), t.end());
    return !known.insert(t).second;
  });
  surface.repairs.doubled_triangles = static_cast<int>(doubled);
}

// A use of an edge by a triangle, `forward` if it runs from the lower vertex to the higher.
struct EdgeUse {
  Edge edge;
  int triangle;
  bool forward;
};

std::vector<EdgeUse> sorted_edge_uses(const TriangleSurface& surface) {
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
  return uses;
}

// Calls visit(uses of one edge), edge by edge.
template <class Visit>
void for_each_edge(const TriangleSurface& surface, const Visit& visit) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(surface);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
    visit(std::span(uses).subspan(i, end - i));
    i = end;
  }
}

// Across edges of two triangles each, starting from the first triangle of each such patch.
void unite_windings(TriangleSurface& surface) {
  struct Neighbour {
    int triangle;
    bool opposed;  // it faces the other side
  };
  std::vector<std::vector<Neighbour>> neighbours(surface.triangles.size());
  for_each_edge(surface, [&neighbours](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    const bool opposed = uses[0].forward == uses[1].forward;
    neighbours[uses[0].triangle].push_back({uses[1].triangle, opposed});
    neighbours[uses[1].triangle].push_back({uses[0].triangle, opposed});
  });
  enum class Side : char { unknown, first, other };
  std::vector<Side> sides(surface.triangles.size(), Side::unknown);
  for (std::size_t start = 0; start < sides.size(); ++start) {
    if (sides[start] != Side::unknown) continue;
    std::vector<int> patch{static_cast<int>(start)};
    sides[start] = Side::first;
    for (std::size_t i = 0; i < patch.size(); ++i)
      for (const Neighbour& next : neighbours[patch[i]])
        if (sides[next.triangle] == Side::unknown) {
          sides[next.triangle] = (sides[patch[i]] == Side::first) == next.opposed ? Side::other : Side::first;
          patch.push_back(next.triangle);
        }
    const auto others = std::count_if(patch.begin(), patch.end(), [&](int t) { return sides[t] == Side::other; });
    const Side fewer = 2 * static_cast<std::size_t>(others) > patch.size() ? Side::first : Side::other;
    for (const int t : patch)
      if (sides[t] == fewer) {
        std::swap(surface.triangles[t][1], surface.triangles[t][2]);
        ++surface.repairs.turned_triangles;
      }
  }
}

bool encloses_something(const TriangleSurface& surface) {
  const Vector3 box = surface.vertices.rowwise().maxCoeff() - surface.vertices.rowwise().minCoeff();
  return std::abs(volume(surface)) > 1e-12 * std::pow(box.maxCoeff(), 3);
}

}  // namespace

std::string to_text(const SurfaceRepair& repairs) {
  std::string text;
  const auto add = [&text](const char* verb, int count, const char* one, const char* many) {
    if (count > 0)
      text +=
          std::string(text.empty() ? "" : ", ") + verb + " " + std::to_string(count) + " " + (count == 1 ? one : many);
  };
  add("merged", repairs.merged_vertices, "vertex", "vertices");
  add("dropped", repairs.dropped_vertices, "vertex of no triangle", "vertices of no triangle");
  add("dropped", repairs.dropped_triangles, "collapsed triangle", "collapsed triangles");
  add("dropped", repairs.doubled_triangles, "doubled triangle", "doubled triangles");
  add("turned", repairs.turned_triangles, "triangle to the side of its neighbours",
      "triangles to the side of their neighbours");
  if (repairs.flipped) text += std::string(text.empty() ? "" : ", ") + "turned the surface inside out";
  return text;
}

SurfaceTopology topology_of(const TriangleSurface& surface) {
  SurfaceTopology topology{.pieces = count_pieces(surface)};
  for_each_edge(surface, [&topology](std::span<const EdgeUse> uses) {
    topology.open_edges += uses.size() == 1;
    topology.branching_edges += uses.size() > 2;
    topology.opposed_edges += uses.size() == 2 && uses[0].forward == uses[1].forward;
  });
  return topology;
}

void check_closed(const TriangleSurface& surface) {
  for_each_edge(surface, [&surface](std::span<const EdgeUse> uses) {
    if (uses.size() == 2 && uses[0].forward != uses[1].forward) return;
    const auto corner = [&](int v) {
      std::string place = "vertex (";
      for (int axis = 0; axis < 3; ++axis)
        place.append(axis > 0 ? ", " : "").append(to_text(surface.vertices(axis, v)));
      return place.append(")");
    };
    const std::string edge = "the edge from " + corner(uses[0].edge[0]) + " to " + corner(uses[0].edge[1]);
    if (uses.size() == 1) fail(surface, "the surface is open: " + edge + " belongs to one triangle only");
    if (uses.size() > 2)
      fail(surface, "the surface branches: " + edge + " belongs to " + std::to_string(uses.size()) + " triangles");
    fail(surface, "neighbouring triangles face opposite sides: both run through " + edge + " in the same direction");
  });
  if (!encloses_something(surface)) fail(surface, "the surface encloses a volume of " + to_text(volume(surface)));
}

void repair(TriangleSurface& surface, Real merge_tolerance) {
  if (!(merge_tolerance >= 0) || merge_tolerance >= 1)
    throw std::invalid_argument("repair: merge_tolerance is " + to_text(merge_tolerance) + ", not between 0 and 1");
  surface.repairs = {};
  check(surface);
  merge_vertices(surface, merge_tolerance);
  drop_doubled_triangles(surface);
  drop_unused_vertices(surface);
  unite_windings(surface);
  if (topology_of(surface).is_closed() && volume(surface) < 0) {
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
