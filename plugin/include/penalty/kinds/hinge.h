// Two triangles that share an edge: the mathematics of both angles that are measured about it.
#pragma once
#include <numbers>

#include "penalty/kinds/degenerate.h"

namespace penalty::detail {

///             p2
///            /  \            e = p1 - p0, a = p2 - p0, b = p3 - p0
///           /    \           N_A = e x a, N_B = b x e: both towards the viewer where the hinge is flat
///        p0 --e--> p1
///           \    /           theta = atan2((N_A x N_B) . e / |e|, N_A . N_B)
///            \  /
///             p3
///
/// Since (N_A x N_B) . e = -|e|² a . (b x e), the sine needs one triple product only, and its sign is that of minus the
/// volume of the tetrahedron p0 p1 p2 p3.
struct FoldedEdge {
  Triple edge, a, b, normal_a, normal_b;

  explicit FoldedEdge(const Points<4>& p)
      : edge(Triple::column(p, 1) - Triple::column(p, 0)),
        a(Triple::column(p, 2) - Triple::column(p, 0)),
        b(Triple::column(p, 3) - Triple::column(p, 0)),
        normal_a(cross(edge, a)),
        normal_b(cross(b, edge)) {}

  // Adding 0 turns a zero of either sign into +0, so that a half turn is +pi.
  Real sine() const { return 0.0 - std::sqrt(dot(edge, edge)) * dot(normal_a, b); }  // times |N_A| |N_B|, as the next
  Real cosine() const { return dot(normal_a, normal_b); }
  Real bending_angle() const { return std::atan2(sine(), cosine()); }
  Real dihedral_angle() const { return std::atan2(0.0 - sine(), 0.0 - cosine()); }

  bool has_wings() const { return !is_thin(edge, a, normal_a) && !is_thin(edge, b, normal_b); }

  /// Throws std::invalid_argument that names the wing without an area.
  void require_wings(std::string_view kind) const {
    require_area(kind, "area of triangle p0 p1 p2", edge, a);
    require_area(kind, "area of triangle p0 p1 p3", edge, b);
  }

  /// dtheta/dp into `g`, which is overwritten; zero where a wing has no area. A wing w with normal N and height h = |N|
  /// / |e| turns theta by -N/|N| / h when its tip moves, and by c_0 and c_1 times that when p0 and p1 do, where c = (t
  /// - 1, -t, 1) and t = w . e / |e|² is the foot of the height on the edge.
  void gradient(Gradient<4>& g) const {
    if (!has_wings()) [[unlikely]] {
      g.setZero();
      return;
    }
    const Real edge2 = dot(edge, edge), length = std::sqrt(edge2);
    const Triple g2 = normal_a * (-length / dot(normal_a, normal_a));
    const Triple g3 = normal_b * (-length / dot(normal_b, normal_b));
    const Triple g1 = g2 * (-dot(a, edge) / edge2) + g3 * (-dot(b, edge) / edge2);
    (-(g1 + g2 + g3)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    g3.store(g, 3);
  }

  /// d²theta/dp²; zero where a wing has no area. The tips are not coupled; each wing adds to the blocks of p0, p1 and
  /// its tip
  ///   c_i c_j S / h² + c_i s_j ê nᵀ / (|e| h) + s_i c_j n êᵀ / (|e| h) + s_i s_j S / 2|e|²
  /// with n = N / |N|, m the unit vector across the edge to the tip, S = n mᵀ + m nᵀ, c as above and s = (-1, 1, 0).
  /// From differentiating the gradient in the frame ê, m, n; the parts of the two wings that are not symmetric cancel.
  Hessian<4> hessian() const {
    Hessian<4> h = Hessian<4>::Zero();
    if (!has_wings()) return h;
    add_wing(a, normal_a, 2, h);
    add_wing(b, normal_b, 3, h);
    return h;
  }

 private:
  void add_wing(Triple wing, Triple normal, int tip, Hessian<4>& h) const {
    const Real edge2 = dot(edge, edge), length = std::sqrt(edge2);
    const Real norm = std::sqrt(dot(normal, normal)), height = norm / length;
    const Real foot = dot(wing, edge) / edge2;
    const Triple across = wing - edge * foot;
    const Vector3 e = Vector3(edge.x, edge.y, edge.z) / length;
    const Vector3 n = Vector3(normal.x, normal.y, normal.z) / norm;
    const Vector3 m = Vector3(across.x, across.y, across.z) / height;
    const Matrix3 s = n * m.transpose() + m * n.transpose();
    const Matrix3 both_tip = s / (height * height), both_edge = s / (2 * edge2);
    const Matrix3 tip_edge = e * n.transpose() / (length * height);
    const int points[3] = {0, 1, tip};
    const Real c[3] = {foot - 1, -foot, 1}, d[3] = {-1, 1, 0};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        h.block<3, 3>(3 * points[i], 3 * points[j]) += c[i] * c[j] * both_tip + c[i] * d[j] * tip_edge +
                                                       d[i] * c[j] * tip_edge.transpose() + d[i] * d[j] * both_edge;
  }
};

/// The difference of two angles in [-pi, pi], taken the short way round: in (-pi, pi].
inline Real wrapped_difference(Real angle, Real rest_angle) {
  const Real difference = angle - rest_angle;
  if (difference > std::numbers::pi) return difference - 2 * std::numbers::pi;
  if (difference <= -std::numbers::pi) return difference + 2 * std::numbers::pi;
  return difference;
}

/// The kinds that measure a folded edge: C is the angle less the rest angle, wrapped to (-pi, pi]. `Kind` has a name
/// and `angle_of(edge)`, which differs from theta by a constant or not at all.
template <class Kind>
struct AngleAboutEdge {
  static constexpr int num_points = 4;
  static constexpr Real period = 2 * std::numbers::pi;  // of C: targets are taken the shorter way round

  /// Throws std::invalid_argument for a wing without an area.
  static Kind at_rest(const Points<4>& rest) {
    const FoldedEdge edge(rest);
    edge.require_wings(Kind::name);
    Kind kind;
    kind.rest_angle = Kind::angle_of(edge);
    return kind;
  }

  static Real angle(const Points<4>& p) { return Kind::angle_of(FoldedEdge(p)); }

  Real value(const Points<4>& p) const { return wrapped_difference(angle(p), rest_angle); }

  Gradient<4> gradient(const Points<4>& p) const {
    Gradient<4> g;
    FoldedEdge(p).gradient(g);
    return g;
  }

  Real value_and_gradient(const Points<4>& p, Gradient<4>& g) const {
    const FoldedEdge edge(p);
    edge.gradient(g);
    return wrapped_difference(Kind::angle_of(edge), rest_angle);
  }

  Hessian<4> hessian(const Points<4>& p) const { return FoldedEdge(p).hessian(); }

  Real rest_angle = 0;  // in (-pi, pi]
};

}  // namespace penalty::detail
