// The chain rule, written once: from a constraint C to its potential, force, stiffness and damping.
#pragma once
#include "penalty/constraints/constraint.h"
#include "penalty/math/psd_projection.h"

namespace penalty {

enum class StiffnessModel {
  gauss_newton,   // K dC dCᵀ: positive semidefinite, exact where C = 0
  exact,          // K (dC dCᵀ + C d²C): the second derivative of E; indefinite away from rest
  psd_projected,  // the exact one with its negative eigenvalues set to zero
};

/// E = K/2 C² [J], the potential of a constraint.
template <Constraint Kind>
Real energy(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points) {
  const Real c = kind.value(points);
  return stiffness / 2 * c * c;
}

/// F_i = -dE/dp_i = -K C dC/dp_i [N], one column a point (seed eq. 2 and 8; eq. 13 and 20 for lengths and volumes).
template <Constraint Kind>
Gradient<Kind::num_points> force(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points) {
  Gradient<Kind::num_points> gradient;
  const Real c = value_and_gradient(kind, points, gradient);
  return gradient * (-stiffness * c);
}

/// d²E/dp² [N/m]. A kind without a Hessian has its Gauss-Newton stiffness under every model.
template <Constraint Kind>
Hessian<Kind::num_points> stiffness_matrix(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points,
                                           StiffnessModel model) {
  Gradient<Kind::num_points> gradient;
  const Real c = value_and_gradient(kind, points, gradient);
  const auto g = gradient.reshaped();
  Hessian<Kind::num_points> k = g * g.transpose();
  if constexpr (HasHessian<Kind>)
    if (model != StiffnessModel::gauss_newton) k += c * kind.hessian(points);
  k *= stiffness;
  return model == StiffnessModel::psd_projected ? psd_projection(k) : k;
}

/// Damping along the gradient, F_i = -d (dC/dt) dC/dp_i with dC/dt = sum_j dC/dp_j . v_j [N]: it opposes only the motion
/// that changes C, so it has no net force and no net torque. `damping` d in joule seconds.
template <Constraint Kind>
Gradient<Kind::num_points> damping_force(const Kind& kind, Real damping, const Points<Kind::num_points>& points,
                                         const Points<Kind::num_points>& velocities) {
  const Gradient<Kind::num_points> gradient = kind.gradient(points);
  return gradient * (-damping * gradient.cwiseProduct(velocities).sum());
}

}  // namespace penalty
