// The angle between two edges that meet in a point.
#pragma once
#include "penalty/kinds/degenerate.h"

namespace penalty {

/// C = theta - theta0 [rad], with theta in [0, pi] between the legs u = p1 - p0 and v = p2 - p0:
/// theta = atan2(|u x v|, u . v).
///
///             p2
///            o
///        v  /              n = u x v / |u x v|, towards the viewer
///          / theta
///      p0 o--------o p1
///              u
///
/// Gradient: dC/dp1 = -n x u / |u|², dC/dp2 = n x v / |v|², dC/dp0 is minus their sum: each leg turns in the plane of
/// both. The seed suggests angles without working them out; differentiated from theta here.
///
/// At 0 and pi (|u x v| <= 1e-8 |u| |v|) and for a leg without length there is no such plane: gradient and Hessian are
/// zero. Theta has no sign, so a corner that was turned inside out is at rest in its mirror image.
struct CornerAngle {
  static constexpr std::string_view name = "corner angle";
  static constexpr int num_points = 3;

  /// Throws std::invalid_argument for a leg whose length is zero or not finite, and for a rest angle of 0 or pi.
  static CornerAngle at_rest(const Points<3>& rest) {
    const Legs legs(rest);
    const Real lengths = std::sqrt(legs.uu) * std::sqrt(legs.vv);
    require_rest_value(name, "length of leg p0 p1", std::sqrt(legs.uu));
    require_rest_value(name, "length of leg p0 p2", std::sqrt(legs.vv));
    if (!legs.span_a_plane())
      throw std::invalid_argument(std::string(name) + ": sine of the rest angle is " + to_text(legs.sine / lengths));
    return {legs.angle()};
  }

  static Real angle(const Points<3>& p) { return Legs(p).angle(); }

  Real value(const Points<3>& p) const { return angle(p) - rest_angle; }

  Gradient<3> gradient(const Points<3>& p) const {
    Gradient<3> g;
    value_and_gradient(p, g);
    return g;
  }

  Real value_and_gradient(const Points<3>& p, Gradient<3>& g) const {
    const Legs legs(p);
    Triple g1{0, 0, 0}, g2{0, 0, 0};
    if (legs.span_a_plane()) [[likely]] {
      const Triple n = legs.normal * (1 / legs.sine);
      g1 = cross(legs.u, n) * (1 / legs.uu);
      g2 = cross(n, legs.v) * (1 / legs.vv);
    }
    (-(g1 + g2)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    return legs.angle() - rest_angle;
  }

  /// With hats for unit vectors and t = n x û or n x v̂:
  ///   uu: ( û tᵀ + t ûᵀ + cot(theta) n nᵀ) / |u|²
  ///   vv: (-v̂ tᵀ - t v̂ᵀ + cot(theta) n nᵀ) / |v|²
  ///   uv: -n nᵀ / (|u| |v| sin(theta))
  /// The rows of blocks of p0 and the columns are minus the sums of the others.
  Hessian<3> hessian(const Points<3>& p) const {
    const Legs legs(p);
    if (!legs.span_a_plane()) return Hessian<3>::Zero();
    const Real u_length = std::sqrt(legs.uu), v_length = std::sqrt(legs.vv);
    const Vector3 n = Vector3(legs.normal.x, legs.normal.y, legs.normal.z) / legs.sine;
    const Vector3 u = Vector3(legs.u.x, legs.u.y, legs.u.z) / u_length;
    const Vector3 v = Vector3(legs.v.x, legs.v.y, legs.v.z) / v_length;
    const Vector3 tu = n.cross(u), tv = n.cross(v);
    const Matrix3 nn = n * n.transpose();
    const Real cotangent = legs.cosine / legs.sine;
    const Matrix3 u_turn = u * tu.transpose() + tu * u.transpose(), v_turn = v * tv.transpose() + tv * v.transpose();
    const Matrix3 uu = (cotangent * nn + u_turn) / legs.uu;
    const Matrix3 vv = (cotangent * nn - v_turn) / legs.vv;
    const Matrix3 uv = nn / -legs.sine;  // sine already holds both lengths
    const Matrix3 u0 = -(uu + uv), v0 = -(vv + uv);
    Hessian<3> h;
    h << -(u0 + v0), u0, v0,  //
        u0, uu, uv,           //
        v0, uv, vv;
    return h;
  }

  Real rest_angle;  // theta0, in (0, pi)

 private:
  // Sine and cosine are both times |u| |v|.
  struct Legs {
    Triple u, v, normal;
    Real uu, vv, sine, cosine;

    explicit Legs(const Points<3>& p)
        : u(Triple::column(p, 1) - Triple::column(p, 0)),
          v(Triple::column(p, 2) - Triple::column(p, 0)),
          normal(cross(u, v)),
          uu(dot(u, u)),
          vv(dot(v, v)),
          sine(std::sqrt(dot(normal, normal))),
          cosine(dot(u, v)) {}

    Real angle() const { return std::atan2(sine, cosine); }
    bool span_a_plane() const { return sine * sine > detail::smallest_sine * detail::smallest_sine * uu * vv; }
  };
};

}  // namespace penalty
