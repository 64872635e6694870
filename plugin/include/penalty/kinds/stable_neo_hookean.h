// A hyperelastic material for one tetrahedron, as an energy of its own.
#pragma once
#include <algorithm>
#include <cmath>

#include "penalty/kinds/kind.h"
#include "penalty/math/isotropic_projection.h"
#include "penalty/math/triple.h"

namespace penalty {

/// The stable neo-Hookean material (Smith, de Goes and Kim 2018, "Stable Neo-Hookean Flesh Simulation", eq. 14, with
/// their reparameterised Lamé parameters): E = K psi with K = mu |V0| [J] and, in units of mu,
///
///     psi = m/2 (I - 3) - m/2 ln((I + 1) / 4) + l/2 ((J - alpha)² - (1 - alpha)²),     F = D D0⁻¹, I = |F|², J = det F
///     m = 4/3,   l = lambda/mu + 5/6,   alpha = 1 + 3m/4l = 1 + 1/l
///
///          p3
///          /|\           D = [p1 - p0, p2 - p0, p3 - p0], D0 the same at rest
///         / | \          J = V / V0 with signed volumes, as in TetrahedronVolume: either orientation will do
///        /  |  \         and an inverted tetrahedron has J < 0
///      p0 --|-- p2
///        \  |  /
///         \ | /
///          p1
///
/// Near rest it is the isotropic linear material of mu and lambda, exactly, whatever the mesh. psi is smooth
/// everywhere, also where the tetrahedron is flat or inverted, and is zero only at rest, up to rigid motion. With all
/// points in one place the gradient is zero, but the logarithm keeps this from being a minimum: psi falls along every
/// small F with J > 0. `energy_and_gradient` takes their eq. 18, P = dpsi/dF = m (1 - 1/(I + 1)) F + l (J - alpha)
/// dJ/dF, and dpsi/dp from it.
struct StableNeoHookean {
  static constexpr std::string_view name = "stable neo-Hookean";
  static constexpr int num_points = 4;
  static constexpr bool damps_edges = true;

  /// A prototype for `at_rest`; lambda/mu = 2 nu / (1 - 2 nu). Throws std::invalid_argument for a ratio that is
  /// negative or not finite.
  static StableNeoHookean with_ratio(Real lambda_over_mu) {
    require_ratio(lambda_over_mu);
    return {Matrix3::Zero(), lambda_over_mu};
  }

  static StableNeoHookean example(Real /*size*/) { return with_ratio(1.5); }

  /// The same material with these points at rest. Throws std::invalid_argument for a rest volume that is zero or not
  /// finite.
  StableNeoHookean at_rest(const Points<4>& rest) const {
    require_ratio(lambda_over_mu);
    const Matrix3 edges = rest.rightCols<3>().colwise() - rest.col(0);
    const Vector3 a = edges.col(0), b = edges.col(1), c = edges.col(2);
    const Real determinant = a.dot(b.cross(c));
    require_rest_value(name, "rest volume", determinant / 6);
    Matrix3 adjugate;
    adjugate.row(0) = b.cross(c);
    adjugate.row(1) = c.cross(a);
    adjugate.row(2) = a.cross(b);
    const StableNeoHookean element{adjugate / determinant, lambda_over_mu};
    for (const Real entry : element.inverse_rest.reshaped()) require_finite(entry);
    return element;
  }

  Real rest_volume() const { return 1 / (6 * inverse_rest.determinant()); }

  [[gnu::always_inline]] Real energy(const Points<4>& p) const {
    const State s(*this, p);
    return psi(s);
  }

  [[gnu::always_inline]] Real energy_and_gradient(const Points<4>& p, Gradient<4>& g) const {
    const State s(*this, p);
    gradient(s, g);
    return psi(s);
  }

  /// Without the logarithm, which only psi itself has.
  [[gnu::always_inline]] void energy_gradient(const Points<4>& p, Gradient<4>& g) const {
    gradient(State(*this, p), g);
  }

  /// d²psi/dp². Moving p_a by x changes F by x w_aᵀ, w_a row a of D0⁻¹ (w_0 minus their sum); with u_a = F w_a and
  /// v_a = (dJ/dF) w_a the block (a, b) is
  ///   m (1 - 1/(I + 1)) (w_a . w_b) 1 + 2m/(I + 1)² u_a u_bᵀ + l v_a v_bᵀ - l (J - alpha) [F (w_a x w_b)].
  Hessian<4> energy_hessian(const Points<4>& p) const {
    const State s(*this, p);
    Matrix3 f, cofactor;
    for (int k = 0; k < 3; ++k) {
      s.f[k].store(f, k);
      s.cofactor[k].store(cofactor, k);
    }
    Eigen::Matrix<Real, 3, 4> w;
    w.rightCols<3>() = inverse_rest.transpose();
    w.col(0) = -w.rightCols<3>().rowwise().sum();
    const Eigen::Matrix<Real, 3, 4> u = f * w, v = cofactor * w;
    const Real stretch = shear * (1 - s.inverse), swell = bulk() * s.dilation - 1;
    Hessian<4> h = (2 * shear * s.inverse * s.inverse) * (u.reshaped() * u.reshaped().transpose()) +
                   bulk() * (v.reshaped() * v.reshaped().transpose());
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b) {
        const Vector3 turned = f * w.col(a).cross(w.col(b));
        const Matrix3 block = stretch * w.col(a).dot(w.col(b)) * Matrix3::Identity() - swell * cross_matrix(turned);
        h.block<3, 3>(3 * a, 3 * b) += block;
        if (a != b) h.block<3, 3>(3 * b, 3 * a) += block.transpose();
      }
    return h;
  }

  /// d²psi/dp² with the negative eigenvalues of d²psi/dF² set to zero, as is usual: positive semidefinite, no less than
  /// d²psi/dp², and equal to it where that is positive semidefinite already. Among such matrices it is not the nearest
  /// one to d²psi/dp²: that would depend on the shape at rest, and this one depends on the material and F only.
  ///
  /// dpsi/dI = m/2 (1 - 1/(I + 1)), d²psi/dI² = m/2 / (I + 1)², dpsi/dJ = l (J - alpha), d²psi/dJ² = l.
  Hessian<4> projected_hessian(const Points<4>& p) const {
    const State s(*this, p);
    Matrix3 f;
    for (int k = 0; k < 3; ++k) s.f[k].store(f, k);
    const SignedSvd svd = signed_svd(f);
    auto stiffness = PrincipalStiffness::of({.i = shear / 2 * (1 - s.inverse),
                                             .ii = shear / 2 * s.inverse * s.inverse,
                                             .j = bulk() * s.dilation - 1,
                                             .jj = bulk()},
                                            svd.s);
    stiffness.make_psd();
    return isotropic_hessian(svd, stiffness, inverse_rest);
  }

  /// Calls visit(weight, gradient) for every mode of a viscosity that, with the weights in units of K, averages over
  /// directions to the material's own moduli: the relative lengths of the six edges, weight 15/6 each, and, where
  /// lambda exceeds mu, the relative volume, weight lambda/mu - 1. Each mode alone keeps linear and angular momentum.
  /// An edge whose points coincide (closer than 1e-9 of its length at rest) has its direction at rest.
  template <class Visit>
  [[gnu::always_inline]] void visit_damping_modes(const Points<4>& p, const Visit& visit) const {
    // Rows of the inverse are x, y, z; the edges at rest are y x z, z x x, x x y over its determinant 1 / 6V0.
    const Triple x = row(0), y = row(1), z = row(2);
    const Triple yz = cross(y, z);
    const Real inverse_volume = dot(x, yz), volume = 1 / inverse_volume;
    const Triple rest[4] = {{0, 0, 0}, yz * volume, cross(z, x) * volume, cross(x, y) * volume};
    Gradient<4> g;
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        const Triple edge = Triple::column(p, j) - Triple::column(p, i), rest_edge = rest[j] - rest[i];
        const Real rest_length2 = dot(rest_edge, rest_edge), length2 = dot(edge, edge);
        const bool coincide = !(length2 > 1e-18 * rest_length2);
        // n / L0, of an edge of length |e|: e / (|e| L0)
        const Triple mode = coincide ? rest_edge * (1 / rest_length2) : edge * (1 / std::sqrt(length2 * rest_length2));
        g.setZero();
        (-mode).store(g, i);
        mode.store(g, j);
        visit(15.0 / 6, g);
      }
    if (!(lambda_over_mu > 1)) return;
    const Triple p0 = Triple::column(p, 0);
    const Triple a = Triple::column(p, 1) - p0, b = Triple::column(p, 2) - p0, c = Triple::column(p, 3) - p0;
    const Triple g1 = cross(b, c) * inverse_volume, g2 = cross(c, a) * inverse_volume,
                 g3 = cross(a, b) * inverse_volume;
    (-(g1 + g2 + g3)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    g3.store(g, 3);
    visit(lambda_over_mu - 1, g);
  }

  static constexpr Real shear = 4.0 / 3;                  // m
  Real bulk() const { return lambda_over_mu + 5.0 / 6; }  // l

  Matrix3 inverse_rest;  // D0⁻¹ [1/m]; zero in a prototype
  Real lambda_over_mu;

 private:
  Triple row(int k) const { return {inverse_rest(k, 0), inverse_rest(k, 1), inverse_rest(k, 2)}; }

  // Columns of F and of dJ/dF, and the invariants.
  struct State {
    Triple f[3], cofactor[3];
    Real invariant, inverse, dilation;  // I, 1 / (I + 1), J - 1

    [[gnu::always_inline]] State(const StableNeoHookean& element, const Points<4>& p) {
      const Matrix3& rest = element.inverse_rest;
      const Triple p0 = Triple::column(p, 0);
      const Triple a = Triple::column(p, 1) - p0, b = Triple::column(p, 2) - p0, c = Triple::column(p, 3) - p0;
      for (int k = 0; k < 3; ++k) f[k] = a * rest(0, k) + b * rest(1, k) + c * rest(2, k);
      cofactor[0] = cross(f[1], f[2]);
      cofactor[1] = cross(f[2], f[0]);
      cofactor[2] = cross(f[0], f[1]);
      invariant = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
      inverse = 1 / (invariant + 1);
      dilation = dot(f[0], cofactor[0]) - 1;
    }
  };

  [[gnu::always_inline]] void gradient(const State& s, Gradient<4>& g) const {
    const Real stretch = shear * (1 - s.inverse), swell = bulk() * s.dilation - 1;  // l (J - alpha)
    const Triple p0 = s.f[0] * stretch + s.cofactor[0] * swell;
    const Triple p1 = s.f[1] * stretch + s.cofactor[1] * swell;
    const Triple p2 = s.f[2] * stretch + s.cofactor[2] * swell;
    const auto to_point = [&](int k) {
      return p0 * inverse_rest(k, 0) + p1 * inverse_rest(k, 1) + p2 * inverse_rest(k, 2);
    };
    const Triple g1 = to_point(0), g2 = to_point(1), g3 = to_point(2);
    (-(g1 + g2 + g3)).store(g, 0);
    g1.store(g, 1);
    g2.store(g, 2);
    g3.store(g, 3);
  }

  // psi with H = F - 1, so that the terms that are large near rest cancel on paper and not in floating point: with
  // y = (I - 3)/4 it is |H|²/2 - (sum of the principal 2 x 2 minors of H) - det H + m/2 (y - ln(1 + y)) + l/2 (J - 1)².
  [[gnu::always_inline]] Real psi(const State& s) const {
    const Real xx = s.f[0].x - 1, yx = s.f[0].y, zx = s.f[0].z;
    const Real xy = s.f[1].x, yy = s.f[1].y - 1, zy = s.f[1].z;
    const Real xz = s.f[2].x, yz = s.f[2].y, zz = s.f[2].z - 1;
    const Real squares = xx * xx + yx * yx + zx * zx + xy * xy + yy * yy + zy * zy + xz * xz + yz * yz + zz * zz;
    const Real minor_x = yy * zz - yz * zy;
    const Real minors = minor_x + (xx * zz - xz * zx) + (xx * yy - xy * yx);
    const Real determinant = xx * minor_x - xy * (yx * zz - yz * zx) + xz * (yx * zy - yy * zx);
    // log1p at a third of its price: what rounding took from 1 + y is added to first order.
    const Real y = (s.invariant - 3) / 4, u = 1 + y;
    const Real logarithm = std::log(u) + 4 * (y - (u - 1)) * s.inverse;
    const Real sum =
        squares / 2 - minors - determinant + shear / 2 * (y - logarithm) + bulk() / 2 * s.dilation * s.dilation;
    return std::max<Real>(sum, 0);  // negative only by round-off, next to rest
  }

  static void require_ratio(Real ratio) {
    if (!(ratio >= 0) || ratio - ratio != 0)
      throw std::invalid_argument(std::string(name) + ": lambda/mu is " + to_text(ratio) +
                                  ", must be zero or positive and finite");
  }
  static void require_finite(Real entry) {
    if (entry - entry != 0)
      throw std::invalid_argument(std::string(name) + ": inverse rest matrix has the entry " + to_text(entry));
  }
};

}  // namespace penalty
