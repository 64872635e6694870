// The volume that a closed surface of triangles encloses.
#pragma once
#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "penalty/kinds/kind.h"
#include "penalty/math/triple.h"

namespace penalty {

/// C = (V - V0) / V0, dimensionless, with the signed volume V = 1/6 sum over the triangles of a . (b x c) (seed eq. 14
/// summed over the tetrahedra between the triangles and one common point). A balloon, a bladder, a muscle.
///
///            c
///           / \          The triangle a b c turns counter-clockwise seen from outside: V > 0. The other way round
///           works
///          /   \         as well: V0 is signed.
///         a-----b
///
/// Gradient: dV/da is a third of the area vectors of the triangles around a: 1/6 sum of b x c (seed eq. 18), which for
/// a closed surface is 1/6 sum of (b - a) x (c - a), since a x b comes back with the other sign from the triangle
/// across the edge a b. Hessian: d²V/da db = [d - c]/6 for the edge between the triangles a b c and b a d, zero on the
/// diagonal.
///
/// V is a polynomial, without degenerate points: an inverted surface is pulled back through flat. Only where all
/// triangles around every point have collapsed is the gradient zero. V is taken relative to the first point, which
/// changes nothing for a closed surface and keeps the digits of a small one far from the origin.
///
/// The kind shares its triangles with its copies. It has any number of points: `value_and_gradient` allocates nothing.
class EnclosedVolume {
 public:
  static constexpr std::string_view name = "enclosed volume";
  static constexpr int num_points = dynamic;
  using Triangle = std::array<int, 3>;

  /// A prototype: `triangles` index the points of the stencil. Throws std::invalid_argument, naming the first bad edge,
  /// unless every directed edge occurs once and its opposite once; several closed pieces are allowed.
  explicit EnclosedVolume(std::vector<Triangle> triangles) {
    require_closed(triangles);
    for (const Triangle& t : triangles) num_points_ = std::max({num_points_, t[0] + 1, t[1] + 1, t[2] + 1});
    triangles_ = std::make_shared<const std::vector<Triangle>>(std::move(triangles));
  }

  static constexpr int num_example_points = 6;  // of an octahedron
  static EnclosedVolume example(Real /*size*/) {
    return EnclosedVolume(
        std::vector<Triangle>{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}});
  }

  /// The kind that is zero at `rest`, 3 x (largest index + 1). Throws std::invalid_argument for another number of
  /// points, and for a rest volume that is not finite or is zero (less than 1e-15 of the cube of the surface's extent).
  EnclosedVolume at_rest(const Points<dynamic>& rest) const {
    if (rest.cols() != num_points_)
      throw std::invalid_argument(std::string(name) + ": " + std::to_string(rest.cols()) +
                                  " points at rest, the triangles have " + std::to_string(num_points_));
    const Real volume = signed_volume(rest);
    require_rest_value(name, "rest volume", volume);
    const Real extent = (rest.rowwise().maxCoeff() - rest.rowwise().minCoeff()).maxCoeff();
    if (!(std::abs(volume) > 1e-15 * extent * extent * extent))
      throw std::invalid_argument(std::string(name) + ": rest volume is " + to_text(volume) +
                                  " m³, zero for a surface of extent " + to_text(extent) + " m");
    EnclosedVolume kind = *this;
    kind.inverse_rest_volume_ = 1 / volume;
    return kind;
  }

  const std::vector<Triangle>& triangles() const { return *triangles_; }
  Real rest_volume() const { return 1 / inverse_rest_volume_; }

  /// V [m³].
  Real signed_volume(const Points<dynamic>& p) const {
    assert(p.cols() == num_points_);
    const Triple origin = Triple::column(p, 0);
    Real six_volumes = 0;
    for (const Triangle& t : *triangles_) {
      const Triple a = Triple::column(p, t[0]);
      six_volumes += dot(a - origin, normal(a, Triple::column(p, t[1]), Triple::column(p, t[2])));
    }
    return six_volumes / 6;
  }

  Real value(const Points<dynamic>& p) const { return signed_volume(p) * inverse_rest_volume_ - 1; }

  Gradient<dynamic> gradient(const Points<dynamic>& p) const {
    Gradient<dynamic> g(3, p.cols());
    value_and_gradient(p, g);
    return g;
  }

  /// Overwrites `g`, which has the size of `p`.
  Real value_and_gradient(const Points<dynamic>& p, Gradient<dynamic>& g) const {
    assert(p.cols() == num_points_ && g.cols() == num_points_);
    const Triple origin = Triple::column(p, 0);
    const Real scale = inverse_rest_volume_ / 6;
    g.setZero();
    Real sum = 0;
    for (const Triangle& t : *triangles_) {
      const Triple a = Triple::column(p, t[0]);
      const Triple share = normal(a, Triple::column(p, t[1]), Triple::column(p, t[2])) * scale;
      sum += dot(a - origin, share);
      for (const int i : t) (Triple::column(g, i) + share).store(g, i);
    }
    return sum - 1;
  }

  /// Dense, 3n x 3n: for small surfaces; see `visit_hessian_blocks` for large ones.
  Hessian<dynamic> hessian(const Points<dynamic>& p) const {
    Hessian<dynamic> h = Hessian<dynamic>::Zero(p.size(), p.size());
    visit_hessian_blocks(p, [&h](int i, int j, const Matrix3& block) { h.block<3, 3>(3 * i, 3 * j) += block; });
    return h;
  }

  /// Calls visit(i, j, block) with 3 x 3 blocks whose sum is d²C / dp_i dp_j: two for each directed edge i j.
  template <class Visit>
  void visit_hessian_blocks(const Points<dynamic>& p, const Visit& visit) const {
    assert(p.cols() == num_points_);
    const Real scale = inverse_rest_volume_ / 6;
    for (const Triangle& t : *triangles_) {
      for (int k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
        const Matrix3 block = cross_matrix((p.col(c) - p.col(0)) * scale);
        visit(a, b, Matrix3(-block));
        visit(b, a, block);
      }
    }
  }

  /// Calls visit(i, j) once for every pair of points whose Hessian block may differ from zero: both directions of every
  /// edge.
  template <class Visit>
  void visit_hessian_pattern(const Visit& visit) const {
    for (const Triangle& t : *triangles_)
      for (int k = 0; k < 3; ++k) visit(t[k], t[(k + 1) % 3]);
  }

 private:
  /// Twice the area vector: (b - a) x (c - a) = a x b + b x c + c x a.
  static Triple normal(Triple a, Triple b, Triple c) { return cross(b - a, c - a); }
  static void require_closed(const std::vector<Triangle>& triangles);

  std::shared_ptr<const std::vector<Triangle>> triangles_;
  int num_points_ = 0;
  Real inverse_rest_volume_ = 1;  // 1 / V0, signed [1/m³]
};

inline void EnclosedVolume::require_closed(const std::vector<Triangle>& triangles) {
  const auto fail = [](const std::string& what) { throw std::invalid_argument(std::string(name) + ": " + what); };
  const auto key = [](int a, int b) { return (static_cast<std::uint64_t>(a) << 32) | static_cast<std::uint32_t>(b); };
  const auto edge_name = [](int a, int b) { return "edge " + std::to_string(a) + "-" + std::to_string(b); };
  if (triangles.empty()) fail("no triangles");
  std::unordered_map<std::uint64_t, std::size_t> triangle_of;  // by directed edge
  triangle_of.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      if (a < 0) fail("index " + std::to_string(a) + " in triangle " + std::to_string(t));
      if (a == b) fail(edge_name(a, b) + " of triangle " + std::to_string(t) + " joins a point to itself");
      const auto [other, is_new] = triangle_of.emplace(key(a, b), t);
      if (!is_new)
        fail(edge_name(a, b) + " is in triangle " + std::to_string(other->second) + " and, in the same direction, in " +
             std::to_string(t));
    }
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      if (!triangle_of.contains(key(b, a)))
        fail(edge_name(a, b) + " of triangle " + std::to_string(t) + " has no triangle on its other side");
    }
  }
}

}  // namespace penalty
