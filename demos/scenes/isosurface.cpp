#include "scenes/isosurface.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

namespace penalty::demo {
namespace {

/// Vertices on the edges of a grid or of a triangle mesh, each made once.
class Crossings {
 public:
  /// Where f crosses zero between points a and b, known by the numbers of the two.
  int at(int a, int b, const Vector3& pa, const Vector3& pb, Real fa, Real fb, const SpaceFunction& f) {
    const std::uint64_t low = static_cast<std::uint32_t>(std::min(a, b)),
                        high = static_cast<std::uint32_t>(std::max(a, b));
    const auto [entry, is_new] = index_.try_emplace(low << 32 | high, static_cast<int>(points_.size()));
    if (is_new) points_.push_back(a < b ? root(pa, pb, fa, fb, f) : root(pb, pa, fb, fa, f));
    return entry->second;
  }
  int add(const Vector3& point) {
    points_.push_back(point);
    return static_cast<int>(points_.size()) - 1;
  }

  Eigen::Matrix3Xd columns() const {
    Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(points_.size()));
    for (std::size_t i = 0; i < points_.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = points_[i];
    return matrix;
  }

 private:
  /// Regula falsi; an end that stays twice has its value halved (Illinois). Never leaves the edge. Bisection while an
  /// end is not finite.
  static Vector3 root(const Vector3& pa, const Vector3& pb, Real fa, Real fb, const SpaceFunction& f) {
    Real a = 0, b = 1, t = 0.5;
    int stayed = 0;  // the end that did: -1 a, 1 b
    for (int k = 0; k < 50 && b - a > 1e-9; ++k) {
      t = std::isfinite(fa) && std::isfinite(fb) ? (a * fb - b * fa) / (fb - fa) : (a + b) / 2;
      const Real ft = f(pa + t * (pb - pa));
      if (ft == 0) break;
      if ((ft > 0) == (fb > 0)) {
        if (stayed == -1) fa /= 2;
        b = t;
        fb = ft;
        stayed = -1;
      } else {
        if (stayed == 1) fb /= 2;
        a = t;
        fa = ft;
        stayed = 1;
      }
    }
    return pa + t * (pb - pa);
  }

  std::unordered_map<std::uint64_t, int> index_;
  std::vector<Vector3> points_;
};

// The six tetrahedra around the diagonal 0-7 of a cube, positively oriented; corner b lies at (b & 1, b >> 1 & 1, b >>
// 2).
constexpr Tetrahedron tetrahedra_of_cube[6] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                               {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

}  // namespace

Isosurface isosurface(const SpaceFunction& f, Real level, const Vector3& low, const Vector3& high, int cells) {
  const SpaceFunction g = [&](const Vector3& p) {
    const Real value = f(p) - level;
    return std::isfinite(value) ? value : std::numeric_limits<Real>::infinity();
  };
  const Real cell = (high - low).maxCoeff() / cells;
  int count[3];
  for (int axis = 0; axis < 3; ++axis)
    count[axis] = std::max(1, static_cast<int>(std::ceil((high - low)[axis] / cell - 1e-9)));
  const auto number = [&](int i, int j, int k) { return i + (count[0] + 1) * (j + (count[1] + 1) * k); };
  const auto point = [&](int n) -> Vector3 {
    const int i = n % (count[0] + 1), j = n / (count[0] + 1) % (count[1] + 1), k = n / (count[0] + 1) / (count[1] + 1);
    return low + cell * Vector3(i, j, k);
  };
  std::vector<Real> values(static_cast<std::size_t>(number(count[0], count[1], count[2]) + 1));
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = g(point(static_cast<int>(n)));

  Isosurface surface;
  Crossings crossings;
  const auto march = [&](const Tetrahedron& t) {
    // Inside corners first. In an even order the tetrahedron is still positively oriented.
    std::array<int, 4> c = t;
    int inside = 0;
    bool even = true;
    for (int k = 0; k < 4; ++k)
      if (values[c[k]] <= 0) {
        if (k != inside) {
          std::swap(c[k], c[inside]);
          even = !even;
        }
        ++inside;
      }
    if (inside == 0 || inside == 4) return;
    const auto cross = [&](int a, int b) {
      return crossings.at(c[a], c[b], point(c[a]), point(c[b]), values[c[a]], values[c[b]], g);
    };
    const auto add = [&](int a, int b, int d) {
      surface.triangles.push_back(even ? Triangle{a, b, d} : Triangle{a, d, b});
    };
    if (inside == 1) {  // a corner cut off: seen from the other three
      add(cross(0, 1), cross(0, 2), cross(0, 3));
    } else if (inside == 3) {
      add(cross(0, 3), cross(1, 3), cross(2, 3));
    } else {  // a quadrilateral
      const int ac = cross(0, 2), ad = cross(0, 3), bd = cross(1, 3), bc = cross(1, 2);
      add(ac, ad, bd);
      add(ac, bd, bc);
    }
  };
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i)
        for (const Tetrahedron& t : tetrahedra_of_cube) {
          const auto corner = [&](int b) { return number(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2)); };
          march({corner(t[0]), corner(t[1]), corner(t[2]), corner(t[3])});
        }
  surface.vertices = crossings.columns();
  return surface;
}

Isosurface clipped(const Isosurface& surface, const SpaceFunction& keep) {
  const Eigen::Index count = surface.vertices.cols();
  std::vector<Real> values(static_cast<std::size_t>(count));
  std::vector<int> kept(values.size(), -1);
  Crossings points;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const Vector3 p = surface.vertices.col(static_cast<Eigen::Index>(v));
    values[v] = keep(p);
    if (values[v] <= 0) kept[v] = points.add(p);
  }
  Isosurface part;
  for (const Triangle& t : surface.triangles) {
    std::vector<int> polygon;  // corners kept and crossings, in order
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      if (kept[a] >= 0) polygon.push_back(kept[a]);
      if ((kept[a] >= 0) != (kept[b] >= 0))
        polygon.push_back(
            points.at(a, b, surface.vertices.col(a), surface.vertices.col(b), values[a], values[b], keep));
    }
    for (std::size_t k = 2; k < polygon.size(); ++k) part.triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
  }
  part.vertices = points.columns();
  return part;
}

Eigen::Matrix3Xd normals(const Isosurface& surface) {
  Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, surface.vertices.cols());
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) {
      const Vector3 p = surface.vertices.col(t[k]);
      const Vector3 u = Vector3(surface.vertices.col(t[(k + 1) % 3])) - p;
      const Vector3 v = Vector3(surface.vertices.col(t[(k + 2) % 3])) - p;
      const Real weight = u.squaredNorm() * v.squaredNorm();
      if (weight > 0) sums.col(t[k]) += u.cross(v) / weight;
    }
  for (Eigen::Index v = 0; v < sums.cols(); ++v) sums.col(v).normalize();
  return sums;
}

}  // namespace penalty::demo
