#include "render/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace penalty::render {
namespace {

/// Which triangles touch a vertex: those of vertex v are list[first[v]] to list[first[v + 1] - 1].
struct Incidence {
  std::vector<int> first, list;

  Incidence(const std::vector<Triangle>& triangles, Eigen::Index vertices)
      : first(static_cast<std::size_t>(vertices) + 1, 0), list(3 * triangles.size()) {
    for (const Triangle& triangle : triangles)
      for (const int v : triangle) ++first[v + 1];
    for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
    std::vector<int> next(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (const int v : triangles[t]) list[next[v]++] = static_cast<int>(t);
  }
};

void check(const SoftSurface& surface) {
  const Eigen::Index count = surface.vertices.cols();
  if (surface.values.size() != 0 && surface.values.size() != count)
    throw std::invalid_argument("a surface of " + std::to_string(count) + " vertices has " +
                                std::to_string(surface.values.size()) + " values");
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (const int v : surface.triangles[t])
      if (v < 0 || v >= count)
        throw std::invalid_argument("triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
                                    std::to_string(count));
}

}  // namespace

void append_surface(const SoftSurface& surface, const ColorScale& colors, const UnitSpace& space,
                    std::vector<SurfaceVertex>& vertices) {
  check(surface);
  const Eigen::Index count = surface.vertices.cols();
  Eigen::Matrix3Xf positions(3, count);
  std::vector<float> values(static_cast<std::size_t>(count), 0.f);
  for (Eigen::Index v = 0; v < count; ++v) {
    positions.col(v) = space(surface.vertices.col(v));
    if (surface.values.size() != 0) values[v] = static_cast<float>(colors.position(surface.values[v]));
  }

  Eigen::Matrix3Xf areas(3, surface.triangles.size());  // normals, as long as twice the area
  Eigen::Matrix3Xf units(3, surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    areas.col(t) = (positions.col(b) - positions.col(a)).cross(positions.col(c) - positions.col(a));
    const float length = areas.col(t).norm();
    units.col(t) =
        length > 0 && std::isfinite(length) ? Eigen::Vector3f(areas.col(t) / length) : Eigen::Vector3f::Zero();
    if (!std::isfinite(length)) areas.col(t).setZero();
  }

  const Incidence incidence(surface.triangles, count);
  vertices.reserve(vertices.size() + 3 * surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Triangle& triangle = surface.triangles[t];
    if (!positions.col(triangle[0]).allFinite() || !positions.col(triangle[1]).allFinite() ||
        !positions.col(triangle[2]).allFinite())
      continue;
    for (const int v : triangle) {
      Eigen::Vector3f normal = Eigen::Vector3f::Zero();
      for (int i = incidence.first[v]; i < incidence.first[v + 1]; ++i) {
        const int other = incidence.list[i];
        // A neighbour's share falls smoothly with the angle, 1 below 40 degrees and 0 above 65: a hard limit would
        // make facets pop while a body bends.
        const float share = std::clamp((units.col(t).dot(units.col(other)) - 0.42f) / 0.34f, 0.f, 1.f);
        normal += share * areas.col(other);
      }
      const float length = normal.norm();
      if (length > 0)
        normal /= length;
      else
        normal = units.col(t).squaredNorm() > 0 ? Eigen::Vector3f(units.col(t)) : Eigen::Vector3f::UnitY();
      const Eigen::Vector3f p = positions.col(v);
      vertices.push_back({{p.x(), p.y(), p.z()}, {normal.x(), normal.y(), normal.z()}, values[v]});
    }
  }
}

}  // namespace penalty::render
