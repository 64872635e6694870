// A group of points and its rest shape, however it is turned.
#pragma once
#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "penalty/kinds/kind.h"

namespace penalty {

/// psi = 1/(2 S0) min over rotations R and centres c of sum w_i |p_i - (R q_i + c)|², dimensionless: the points p_i,
/// three or more, against their rest positions q_i relative to the weighted mean, w_i being weights (1 if none are
/// given) and S0 = sum w_i |q_i|² (shape matching: Müller, Heidelberger, Teschner and Gross, "Meshless deformations
/// based on shape matching", 2005, eq. 3-7). C = sqrt(2 psi) is the deviation relative to the size of the group; a
/// uniform scaling by s > 0 gives C = |s - 1|. K is in joules.
///
///     q3 o------o q2                     o p2       g_i = R q_i + c, the goal of point i: where it would be if the
///        |      |      R, c     p3 o...  /          group had moved rigidly, and c the weighted mean of the p_i
///     q0 o------o q1    ->      p0 o---o p1
///
/// Gradient: at the best R and c the derivatives by R and c vanish, so dpsi/dp_i = w_i (p_i - g_i) / S0. It has neither
/// net force nor net torque.
///
/// R is never a reflection: a mirror image is deformed and is pulled back. R is not unique where the two smallest
/// singular values of A = sum w_i p_i q_iᵀ, the last one with the sign of det A, sum to zero: where a group has
/// collapsed to a line or a point, and for mirror images with that symmetry. psi is continuous there, with a kink; one
/// of the best rotations is used, always the same for the same points (for a point: the rest orientation), and the
/// gradient, finite, belongs to it. Rest shapes may be planar or collinear; about a line, the part of R that moves
/// nothing plays no role.
///
/// The kind shares its rest shape with its copies. `energy_and_gradient` and `damp` allocate nothing.
class ShapeMatch {
 public:
  static constexpr std::string_view name = "shape match";
  static constexpr int num_points = dynamic;

  static constexpr int num_example_points = 7;

  /// A prototype; no weights: all are 1.
  ShapeMatch() = default;

  /// Throws std::invalid_argument for a weight that is not positive and finite.
  explicit ShapeMatch(std::vector<Real> weights) : weights_(std::move(weights)) {
    for (std::size_t i = 0; i < weights_.size(); ++i)
      if (!(weights_[i] > 0) || !std::isfinite(weights_[i]))
        throw std::invalid_argument(std::string(name) + ": weight " + std::to_string(i) + " is " +
                                    to_text(weights_[i]) + ", must be positive and finite");
  }

  /// The kind whose rest shape is `rest`, 3 x n with n >= 3. Throws std::invalid_argument for fewer points, for another
  /// number of points than of weights, and for points that are not finite or all in one place.
  ShapeMatch at_rest(const Points<dynamic>& rest) const;

  /// psi >= 0, dimensionless.
  Real energy(const Points<dynamic>& p) const;

  /// C = sqrt(2 psi), the relative deviation.
  Real value(const Points<dynamic>& p) const { return std::sqrt(2 * energy(p)); }

  /// Overwrites `g`, which has the size of `p`, with dpsi/dp [1/m].
  Real energy_and_gradient(const Points<dynamic>& p, Gradient<dynamic>& g) const;

  /// d²psi/dp², exact, 3n x 3n; see `visit_stiffness`.
  Hessian<dynamic> energy_hessian(const Points<dynamic>& p) const;

  /// The Hessian as a diagonal and at most six rank-one terms, two times three: a translation and a rotation of the
  /// whole group cost nothing. Calls visit_diagonal(i, factor) for factor * identity at block (i, i), then
  /// visit_mode(coefficient, mode) for coefficient * mode modeᵀ, with coefficient < 0.
  ///
  /// Differentiating the gradient and Rᵀ A = symmetric = S gives
  ///     d²psi/dp² = 1/S0 (W - w wᵀ / sum w - Bᵀ G⁻¹ B),  G = tr(S) I - S,  B dp = sum w_i q_i x Rᵀ dp_i,
  /// where G⁻¹ B dp is the spin of R. As B W⁻¹ Bᵀ = J = sum w_i (|q_i|² I - q_i q_iᵀ), the eigenvalues of G relative to
  /// J decide the sign: one below 1 (a compressed group) makes the Hessian indefinite. `psd` raises those to 1, which
  /// leaves a positive semidefinite matrix. For the exact one they are raised to 1e-8: R is not unique at 0 and psi has
  /// a kink. Allocates a scratch of the size of `p`.
  template <class VisitDiagonal, class VisitMode>
  void visit_stiffness(const Points<dynamic>& p, bool psd, const VisitDiagonal& visit_diagonal,
                       const VisitMode& visit_mode) const;

  /// Best rotation of the group from rest to `p`.
  Matrix3 rotation(const Points<dynamic>& p) const { return best_fit(p).rotation; }

  /// -damping * w_i / S0 (v_i - v_rigid(p_i)) [N], for damping in J s and velocities in m/s, with the best rigid motion
  /// in the sense of the weights: no net force, no net torque. Overwrites `force`, which has the size of `p`.
  void damping_force(const Points<dynamic>& p, const Points<dynamic>& velocities, Real damping,
                     Gradient<dynamic>& force) const;
  Gradient<dynamic> damping_force(const Points<dynamic>& p, const Points<dynamic>& velocities, Real damping) const {
    Gradient<dynamic> force(3, p.cols());
    damping_force(p, velocities, damping, force);
    return force;
  }

  /// The damping matrix of `damping_force`, in units of the damping, in the form of `visit_stiffness`: a diagonal, and
  /// less the rigid motions, three translations and three rotations.
  template <class VisitDiagonal, class VisitMode>
  void visit_damping(const Points<dynamic>& p, const VisitDiagonal& visit_diagonal, const VisitMode& visit_mode) const;

  /// Damps `velocities` [m/s] implicitly, hence stably, by `damping` [J s²]: damping coefficient times time step. Free
  /// points: what is left after the rigid motion of their masses is divided by 1 + damping * sum w / (S0 * mass), and
  /// both momenta are kept. With pinned points (inverse mass 0, their velocities stay) each point is damped by
  /// w_i / S0 towards the rigid motion of all of them; the pins take the momentum. Kinetic energy only falls, for any
  /// masses, as long as the pins are at rest. One entry of `inverse_masses` [1/kg] a point.
  void damp(const Points<dynamic>& p, std::span<const Real> inverse_masses, Real damping,
            Points<dynamic>& velocities) const;

 private:
  struct RestShape {
    Points<dynamic> arms;       // q_i [m]
    std::vector<Real> weights;  // w_i
    Real total_weight;
    Real scale;      // 1 / S0
    Matrix3 whiten;  // columns t with tᵀ J t = 1, J-orthogonal; zero for an axis that all points are on
  };

  struct Fit {
    Matrix3 rotation, stretch;  // R and A = R S
    Vector3 center;             // c, from the first point: a small group far from the origin keeps its digits

    Vector3 deviation(const RestShape& rest, const Points<dynamic>& p, Eigen::Index i) const {
      return p.col(i) - p.col(0) - center - rotation * rest.arms.col(i);
    }
  };

  Fit best_fit(const Points<dynamic>& p) const;

  // The rank-one terms of the rotation: spins of the rest shape, one a column, and their coefficients; 0: no such term.
  struct Spins {
    Matrix3 rotation, axes;
    Vector3 coefficients;
  };
  Spins spins(const Points<dynamic>& p, bool psd) const;

  // The principal axes of the points as they are; a moment of zero: nothing turns about that axis.
  struct PrincipalAxes {
    Vector3 center, moments;
    Matrix3 axes;
  };
  PrincipalAxes principal_axes(const Points<dynamic>& p) const;

  template <class VisitMode>
  void visit_translations(Gradient<dynamic>& mode, const VisitMode& visit_mode) const;

  std::vector<Real> weights_;
  std::shared_ptr<const RestShape> rest_;
};

template <class VisitDiagonal, class VisitMode>
void ShapeMatch::visit_stiffness(const Points<dynamic>& p, bool psd, const VisitDiagonal& visit_diagonal,
                                 const VisitMode& visit_mode) const {
  const Spins rotations = spins(p, psd);
  const RestShape& rest = *rest_;
  const int n = static_cast<int>(p.cols());
  for (int i = 0; i < n; ++i) visit_diagonal(i, rest.weights[i] * rest.scale);

  Gradient<dynamic> mode(3, n);
  visit_translations(mode, visit_mode);
  for (int k = 0; k < 3; ++k) {
    if (rotations.coefficients[k] == 0) continue;
    const Vector3 axis = rotations.axes.col(k);
    for (int i = 0; i < n; ++i) mode.col(i) = rest.weights[i] * (rotations.rotation * axis.cross(rest.arms.col(i)));
    visit_mode(rotations.coefficients[k], mode);
  }
}

template <class VisitDiagonal, class VisitMode>
void ShapeMatch::visit_damping(const Points<dynamic>& p, const VisitDiagonal& visit_diagonal,
                               const VisitMode& visit_mode) const {
  const RestShape& rest = *rest_;
  const int n = static_cast<int>(p.cols());
  for (int i = 0; i < n; ++i) visit_diagonal(i, rest.weights[i] * rest.scale);

  Gradient<dynamic> mode(3, n);
  visit_translations(mode, visit_mode);
  const PrincipalAxes principal = principal_axes(p);
  for (int k = 0; k < 3; ++k) {
    if (!(principal.moments[k] > 0)) continue;
    const Vector3 axis = principal.axes.col(k);
    for (int i = 0; i < n; ++i) mode.col(i) = rest.weights[i] * axis.cross(Vector3(p.col(i) - principal.center));
    visit_mode(-rest.scale / principal.moments[k], mode);
  }
}

template <class VisitMode>
void ShapeMatch::visit_translations(Gradient<dynamic>& mode, const VisitMode& visit_mode) const {
  mode.setZero();
  for (int axis = 0; axis < 3; ++axis) {
    for (Eigen::Index i = 0; i < mode.cols(); ++i) mode(axis, i) = rest_->weights[i];
    visit_mode(-rest_->scale / rest_->total_weight, mode);
    mode.row(axis).setZero();
  }
}

}  // namespace penalty
