#include "surface_pieces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "winding_number.h"

namespace penalty {
namespace {

// For each triangle a vertex that stands for its piece.
std::vector<int> roots_of(const TriangleSurface& surface) {
  std::vector<int> root(static_cast<std::size_t>(surface.vertices.cols()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Triangle& t : surface.triangles)
    for (const int v : {t[1], t[2]}) root[find(v)] = find(t[0]);
  std::vector<int> roots;
  roots.reserve(surface.triangles.size());
  for (const Triangle& t : surface.triangles) roots.push_back(find(t[0]));
  return roots;
}

TriangleSurface part_of(const TriangleSurface& surface, std::vector<Triangle> triangles) {
  TriangleSurface part{.vertices = {}, .triangles = std::move(triangles), .source = surface.source, .repairs = {}};
  std::map<int, int> new_index;  // in ascending order of the old ones
  for (const Triangle& t : part.triangles)
    for (const int v : t) new_index[v] = 0;
  part.vertices.resize(3, static_cast<Eigen::Index>(new_index.size()));
  int next = 0;
  for (auto& [old, now] : new_index) {
    part.vertices.col(next) = surface.vertices.col(old);
    now = next++;
  }
  for (Triangle& t : part.triangles)
    for (int& v : t) v = new_index[v];
  return part;
}

bool is_inside(const TriangleSurface& inner, const TriangleSurface& outer) {
  const auto low = [](const TriangleSurface& s) -> Vector3 { return s.vertices.rowwise().minCoeff(); };
  const auto high = [](const TriangleSurface& s) -> Vector3 { return s.vertices.rowwise().maxCoeff(); };
  if ((low(inner).array() < low(outer).array()).any() || (high(inner).array() > high(outer).array()).any())
    return false;
  return std::abs(WindingNumber(outer).at(inner.vertices.col(0))) > 0.5;
}

}  // namespace

int count_pieces(const TriangleSurface& surface) {
  std::vector<int> roots = roots_of(surface);
  std::sort(roots.begin(), roots.end());
  return static_cast<int>(std::unique(roots.begin(), roots.end()) - roots.begin());
}

std::vector<TriangleSurface> pieces_of(const TriangleSurface& surface) {
  const std::vector<int> roots = roots_of(surface);
  std::map<int, std::size_t> index;
  std::vector<std::vector<Triangle>> shells;
  for (std::size_t i = 0; i < roots.size(); ++i) {
    const auto [place, is_new] = index.try_emplace(roots[i], shells.size());
    if (is_new) shells.emplace_back();
    shells[place->second].push_back(surface.triangles[i]);
  }
  std::vector<TriangleSurface> parts;
  parts.reserve(shells.size());
  for (const std::vector<Triangle>& shell : shells) parts.push_back(part_of(surface, shell));
  // Each goes with the outermost one around it.
  std::vector<std::size_t> body(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    body[i] = i;
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (k != i && is_inside(parts[i], parts[k]) && (body[i] == i || is_inside(parts[body[i]], parts[k]))) body[i] = k;
  }
  std::vector<TriangleSurface> pieces;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (body[k] != k) continue;
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (body[i] == k) triangles.insert(triangles.end(), shells[i].begin(), shells[i].end());
    pieces.push_back(part_of(surface, std::move(triangles)));
  }
  return pieces;
}

}  // namespace penalty
