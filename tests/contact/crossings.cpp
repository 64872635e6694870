#include "contact/crossings.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

namespace penalty::testing {
namespace {

Vector3 at(const Skin& skin, int particle) { return skin.positions->col(particle).head<3>(); }

bool has(const Triangle& t, int particle) { return t[0] == particle || t[1] == particle || t[2] == particle; }

Real volume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

bool pierces(const Vector3& p, const Vector3& q, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Real size = (q - p).norm() + (b - a).norm() + (c - a).norm();
  const Real none = 1e-13 * size * size * size;  // what lies in one plane does not pierce
  const Real from = volume(a, b, c, p), to = volume(a, b, c, q);
  if (!(from > none && to < -none) && !(from < -none && to > none)) return false;
  const Real u = volume(p, q, a, b), v = volume(p, q, b, c), w = volume(p, q, c, a);
  return (u > none && v > none && w > none) || (u < -none && v < -none && w < -none);
}

Real distance_to_segment(const Vector3& x, const Vector3& a, const Vector3& b) {
  const Real t = std::clamp<Real>((x - a).dot(b - a) / (b - a).squaredNorm(), 0, 1);
  return (x - a - t * (b - a)).norm();
}

// From the plane where the foot lies inside, else from the nearest side.
Real distance_to_triangle(const Vector3& x, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 n = (b - a).cross(c - a);
  const bool inside =
      n.dot((b - a).cross(x - a)) >= 0 && n.dot((c - b).cross(x - b)) >= 0 && n.dot((a - c).cross(x - c)) >= 0;
  if (inside) return std::abs(n.normalized().dot(x - a));
  return std::min({distance_to_segment(x, a, b), distance_to_segment(x, b, c), distance_to_segment(x, c, a)});
}

// Triangles sorted by their lowest x, so that a sweep finds those that overlap in x.
struct Sorted {
  std::vector<std::size_t> order;
  std::vector<Real> low, high;

  explicit Sorted(const Skin& skin) : order(skin.triangles.size()) {
    for (const Triangle& t : skin.triangles) {
      const auto [least, most] = std::minmax({at(skin, t[0]).x(), at(skin, t[1]).x(), at(skin, t[2]).x()});
      low.push_back(least);
      high.push_back(most);
    }
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return low[i] < low[j]; });
  }
  template <class Visit>
  void visit(Real from, Real to, const Visit& visit) const {
    for (const std::size_t t : order) {
      if (low[t] > to) return;
      if (high[t] >= from) visit(t);
    }
  }
};

}  // namespace

int count_crossings(std::span<const Skin> skins) {
  int count = 0;
  for (const Skin& pierced : skins) {
    const Sorted sorted(pierced);
    for (const Skin& skin : skins)
      for (const Edge& edge : edges_of(std::span<const Triangle>(skin.triangles))) {
        const int i = edge[0], j = edge[1];
        const Vector3 p = at(skin, i), q = at(skin, j);
        sorted.visit(std::min(p.x(), q.x()), std::max(p.x(), q.x()), [&](std::size_t k) {
          const Triangle& t = pierced.triangles[k];
          if (&skin == &pierced && (has(t, i) || has(t, j))) return;
          count += pierces(p, q, at(pierced, t[0]), at(pierced, t[1]), at(pierced, t[2]));
        });
      }
  }
  return count;
}

Real least_distance(std::span<const Skin> skins, bool within) {
  Real least = std::numeric_limits<Real>::infinity();
  for (const Skin& other : skins) {
    const Sorted sorted(other);
    for (const Skin& skin : skins) {
      if (&skin == &other && !within) continue;
      std::set<int> particles;
      for (const Triangle& t : skin.triangles) particles.insert(t.begin(), t.end());
      for (const int particle : particles) {
        const Vector3 x = at(skin, particle);
        sorted.visit(x.x() - std::min(least, 1e6), x.x() + std::min(least, 1e6), [&](std::size_t k) {
          const Triangle& t = other.triangles[k];
          if (&skin == &other && has(t, particle)) return;
          least = std::min(least, distance_to_triangle(x, at(other, t[0]), at(other, t[1]), at(other, t[2])));
        });
      }
    }
  }
  return least;
}

}  // namespace penalty::testing
