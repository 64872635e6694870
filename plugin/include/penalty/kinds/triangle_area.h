// The area of a triangle.
#pragma once
#include "penalty/kinds/degenerate.h"

namespace penalty {

/// C = (A - A0) / A0, dimensionless, with A = |N| / 2 and N = (p1 - p0) x (p2 - p0). Either orientation is the same
/// area.
///
///          p2
///          o            e_i = p_{i+2} - p_{i+1}, the edge opposite p_i (indices modulo 3)
///      e1 / \ e0        n = N / |N|, towards the viewer
///        o---o
///      p0  e2  p1
///
/// Gradient: dC/dp_i = n x e_i / 2A0. The seed suggests areas without working them out; the Hessian is the derivative
/// of that, with n taken along.
///
/// A triangle thinner than 1e-8 (|N| over the square of its longer leg) has no normal: n is then that at rest and the
/// Hessian is zero, so a triangle that collapsed onto a line opens again, still without net force or torque. The
/// gradient is zero only if all points coincide, or if the line runs along the normal at rest.
struct TriangleArea {
  static constexpr std::string_view name = "triangle area";
  static constexpr int num_points = 3;

  /// Throws std::invalid_argument for a rest area that is zero, not finite or that of a thin triangle.
  static TriangleArea at_rest(const Points<3>& rest) {
    const Triple p0 = Triple::column(rest, 0);
    const Triple u = Triple::column(rest, 1) - p0, v = Triple::column(rest, 2) - p0;
    const Real area = detail::require_area(name, "rest area", u, v);
    const Triple n = cross(u, v) * (0.5 / area);
    return {1 / area, Vector3(n.x, n.y, n.z).cast<float>()};
  }

  static Real area(const Points<3>& p) {
    const Triple p0 = Triple::column(p, 0);
    const Triple normal = cross(Triple::column(p, 1) - p0, Triple::column(p, 2) - p0);
    return std::sqrt(dot(normal, normal)) / 2;
  }

  Real rest_area() const { return 1 / inverse_rest_area; }

  Real value(const Points<3>& p) const { return area(p) * inverse_rest_area - 1; }

  Gradient<3> gradient(const Points<3>& p) const {
    Gradient<3> g;
    value_and_gradient(p, g);
    return g;
  }

  [[gnu::always_inline]] Real value_and_gradient(const Points<3>& p, Gradient<3>& g) const {
    const Triple p0 = Triple::column(p, 0);
    const Triple u = Triple::column(p, 1) - p0, v = Triple::column(p, 2) - p0;
    Triple normal = cross(u, v);
    const Real norm = std::sqrt(dot(normal, normal));
    Real scale = inverse_rest_area / (2 * norm);
    if (detail::is_thin(u, v, normal)) [[unlikely]] {
      normal = {rest_normal[0], rest_normal[1], rest_normal[2]};
      scale = inverse_rest_area / 2;
    }
    normal = normal * scale;
    const Triple g1 = cross(v, normal), g2 = cross(normal, u);  // e1 = -v, e2 = u
    (-(g1 + g2)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    return norm / 2 * inverse_rest_area - 1;
  }

  /// d²A/dp_i dp_j = (e_i . e_j) n nᵀ / 4A - s_ij [n] / 2 with s_ij = 1 for j = i + 1, -1 for i = j + 1 (modulo 3) and
  /// 0 on the diagonal; all over A0.
  Hessian<3> hessian(const Points<3>& p) const {
    Hessian<3> h = Hessian<3>::Zero();
    const Triple u = Triple::column(p, 1) - Triple::column(p, 0), v = Triple::column(p, 2) - Triple::column(p, 0);
    const Triple doubled = cross(u, v);
    if (detail::is_thin(u, v, doubled)) return h;
    const Real norm = std::sqrt(dot(doubled, doubled));
    const Vector3 n = Vector3(doubled.x, doubled.y, doubled.z) / norm;
    const Vector3 edges[3] = {p.col(2) - p.col(1), p.col(0) - p.col(2), p.col(1) - p.col(0)};
    const Matrix3 across = n * n.transpose() * (inverse_rest_area / (2 * norm));
    const Matrix3 turn = cross_matrix(n) * (inverse_rest_area / 2);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      h.block<3, 3>(3 * i, 3 * i) = edges[i].squaredNorm() * across;
      h.block<3, 3>(3 * i, 3 * j) = edges[i].dot(edges[j]) * across - turn;
      h.block<3, 3>(3 * j, 3 * i) = edges[i].dot(edges[j]) * across + turn;
    }
    return h;
  }

  Real inverse_rest_area;       // 1 / A0 [1/m²]
  Eigen::Vector3f rest_normal;  // n at rest: only a direction, so single precision is enough
};

}  // namespace penalty
