// The signed volume of a tetrahedron.
#pragma once
#include "penalty/kinds/kind.h"
#include "penalty/math/isotropic_projection.h"
#include "penalty/math/triple.h"

namespace penalty {

/// C = (V - V0) / V0, dimensionless, with the signed volume V = a . (b x c) / 6 (seed eq. 14-17).
///
///          p3
///          /|\           a = p1 - p0
///         / | \          b = p2 - p0
///        /  |  \         c = p3 - p0
///      p0 --|-- p2       V > 0: seen from p0, the face p1 p2 p3 turns counter-clockwise
///        \  |  /         away from the viewer.
///         \ | /
///          p1
///
/// Gradient (seed eq. 18-20, written for p1): dC/dp1 = b x c / 6V0, dC/dp2 = c x a / 6V0, dC/dp3 = a x b / 6V0 and
/// dC/dp0 is minus their sum. To get them from one formula by renaming the points, as after seed eq. 20, the renaming
/// must be an even permutation: a cyclic shift of four points is odd and turns the sign of V.
///
/// V0 is the signed rest volume, so either orientation works, and an inverted tetrahedron is pulled back through flat:
/// V is a polynomial, without degenerate points. Only where the points are collinear or coincide is the gradient zero.
struct TetrahedronVolume {
  static constexpr std::string_view name = "tetrahedron volume";
  static constexpr int num_points = 4;

  /// Throws std::invalid_argument for a rest volume that is zero or not finite.
  static TetrahedronVolume at_rest(const Points<4>& rest) {
    const Real volume = signed_volume(rest);
    require_rest_value(name, "rest volume", volume);
    return {1 / volume};
  }

  static Real signed_volume(const Points<4>& p) {
    const Vector3 a = p.col(1) - p.col(0), b = p.col(2) - p.col(0), c = p.col(3) - p.col(0);
    return a.dot(b.cross(c)) / 6;
  }

  Real rest_volume() const { return 1 / inverse_rest_volume; }

  Real value(const Points<4>& p) const { return signed_volume(p) * inverse_rest_volume - 1; }

  Gradient<4> gradient(const Points<4>& p) const {
    Gradient<4> g;
    value_and_gradient(p, g);
    return g;
  }

  /// Inlined whatever the compiler thinks of it, as in every kind that bodies are made of: called, it costs the loop
  /// over the elements twice the instructions.
  [[gnu::always_inline]] Real value_and_gradient(const Points<4>& p, Gradient<4>& g) const {
    const Triple p0 = Triple::column(p, 0);
    const Triple a = Triple::column(p, 1) - p0, b = Triple::column(p, 2) - p0, c = Triple::column(p, 3) - p0;
    const Real scale = inverse_rest_volume * (1.0 / 6);
    const Triple g1 = cross(b, c) * scale, g2 = cross(c, a) * scale, g3 = cross(a, b) * scale;
    (-(g1 + g2 + g3)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    g3.store(g, 3);
    return dot(a, g1) - 1;
  }

  /// Off-diagonal blocks are cross matrices of edges: d²V/dp1dp2 = -[c]/6, d²V/dp2dp3 = -[a]/6, d²V/dp3dp1 = -[b]/6;
  /// the diagonal is zero and every row of blocks sums to zero.
  Hessian<4> hessian(const Points<4>& p) const {
    const Real scale = inverse_rest_volume / 6;
    const Matrix3 a = cross_matrix(p.col(1) - p.col(0)) * scale;
    const Matrix3 b = cross_matrix(p.col(2) - p.col(0)) * scale;
    const Matrix3 c = cross_matrix(p.col(3) - p.col(0)) * scale;
    const Matrix3 zero = Matrix3::Zero();
    Hessian<4> h;
    h << zero, b - c, c - a, a - b,  //
        c - b, zero, -c, b,          //
        a - c, c, zero, -a,          //
        b - a, -b, a, zero;
    return h;
  }

  /// V = det(Y) / 3 with Y = [p0, p1, p2, p3] Q = [a, b, c] M, the columns of Q orthonormal and across (1, 1, 1, 1) and
  /// M its last three rows. As Q is orthonormal, the nearest matrix for Y is also the nearest one for p.
  Hessian<4> projected_stiffness(const Points<4>& p, Real strain) const {
    const Triple p0 = Triple::column(p, 0);
    const Triple a = Triple::column(p, 1) - p0, b = Triple::column(p, 2) - p0, c = Triple::column(p, 3) - p0;
    Matrix3 y, m;
    ((b + c - a) * 0.5).store(y, 0);
    ((c + a - b) * 0.5).store(y, 1);
    ((a + b - c) * 0.5).store(y, 2);
    m << -0.5, 0.5, 0.5, 0.5, -0.5, 0.5, 0.5, 0.5, -0.5;
    const Real slope = inverse_rest_volume / 3;  // dC / d det Y
    const SignedSvd svd = signed_svd(y);
    auto stiffness = PrincipalStiffness::of({.i = 0, .ii = 0, .j = strain * slope, .jj = slope * slope}, svd.s);
    stiffness.make_psd();
    return isotropic_hessian(svd, stiffness, m);
  }

  Real inverse_rest_volume;  // 1 / V0, signed [1/m³]
};

}  // namespace penalty
