// The chain rule, written once: from a kind and its stiffness to potential, force, stiffness and damping.
#pragma once
#include <vector>

#include "penalty/energy/modifiers.h"
#include "penalty/kinds/kind.h"
#include "penalty/math/psd_projection.h"

namespace penalty {

enum class StiffnessModel {
  gauss_newton,   // K dC dCᵀ: positive semidefinite, exact where s = 0; of an energy: psd_projected
  exact,          // K (dC dCᵀ + s d²C): the second derivative of E; indefinite away from rest
  psd_projected,  // the exact one with its negative eigenvalues set to zero; of an energy its `projected_hessian`
  taut,           // gauss_newton, of slack elements too: what the stable step is judged by
};

/// C of an element: its deviation from the rest shape.
template <ElementKind Kind>
Real deviation(const Kind& kind, const Points<Kind::num_points>& points) {
  if constexpr (Constraint<Kind>)
    return kind.value(points);
  else
    return std::sqrt(2 * std::max<Real>(kind.energy(points), 0));
}

struct StrainAndEnergy {
  Real strain;  // s = C unless a profile says otherwise
  Real energy;  // E = K/2 s² [J]
};

template <ElementKind Kind>
StrainAndEnergy strain_and_energy(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points,
                                  const Profile& profile = {}) {
  if constexpr (ElasticEnergy<Kind>)
    if (profile.is_plain()) {
      const Real psi = kind.energy(points);
      return {std::sqrt(2 * std::max<Real>(psi, 0)), stiffness * psi};
    }
  const Real s = profile.strain(deviation(kind, points));
  return {s, stiffness / 2 * s * s};
}

/// E [J]: K/2 s² with s = C unless a profile says otherwise.
template <ElementKind Kind>
Real energy(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points, const Profile& profile = {}) {
  if constexpr (ElasticEnergy<Kind>)
    if (profile.is_plain()) return stiffness * kind.energy(points);  // without the root
  return strain_and_energy(kind, stiffness, points, profile).energy;
}

/// E [J], and dE/dp into `gradient`, which is overwritten [N]: K s dC/dp (seed eq. 2 and 8; eq. 13 and 20 for lengths
/// and volumes); of an energy K (s / C) dpsi/dp.
template <ElementKind Kind>
Real energy_and_gradient(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points,
                         const Profile& profile, Gradient<Kind::num_points>& gradient) {
  if constexpr (Constraint<Kind>) {
    const Real s = profile.strain(value_and_gradient(kind, points, gradient));
    gradient *= stiffness * s;
    return stiffness / 2 * s * s;
  } else {
    const Real psi = kind.energy_and_gradient(points, gradient);
    const Real c = std::sqrt(2 * std::max<Real>(psi, 0));
    const Real s = profile.strain(c);
    if (s == c) {
      gradient *= stiffness;
      return stiffness * psi;
    }
    gradient *= c > 0 ? stiffness * s / c : 0;
    return stiffness / 2 * s * s;
  }
}

/// F_i = -dE/dp_i [N], one column a point.
template <ElementKind Kind>
Gradient<Kind::num_points> force(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points,
                                 const Profile& profile = {}) {
  Gradient<Kind::num_points> gradient(3, points.cols());
  energy_and_gradient(kind, stiffness, points, profile, gradient);
  return -gradient;
}

/// d²E/dp² [N/m]. A constraint without a Hessian has its Gauss-Newton stiffness under every model. The projection is
/// the kind's own closed form, if there is one; that of an energy is for plain profiles only.
template <ElementKind Kind>
Hessian<Kind::num_points> stiffness_matrix(const Kind& kind, Real stiffness, const Points<Kind::num_points>& points,
                                           StiffnessModel model, const Profile& profile = {}) {
  using Matrix = Hessian<Kind::num_points>;
  Gradient<Kind::num_points> gradient(3, points.cols());
  Matrix k;
  const bool bare = model == StiffnessModel::gauss_newton || model == StiffnessModel::taut;
  if constexpr (HasProjectedStiffness<Kind>) {
    if (model == StiffnessModel::psd_projected) {
      const Real c = kind.value(points);
      if (profile.is_slack(c)) return Matrix::Zero(gradient.size(), gradient.size());
      k = kind.projected_stiffness(points, profile.strain(c));
      k *= stiffness;
      return k;
    }
  }
  if constexpr (HasProjectedHessian<Kind>) {
    if (model == StiffnessModel::taut || (model != StiffnessModel::exact && profile.is_plain())) {
      k = kind.projected_hessian(points);
      k *= stiffness;
      return k;
    }
  }
  if constexpr (Constraint<Kind>) {
    const Real c = value_and_gradient(kind, points, gradient);
    if (model != StiffnessModel::taut && profile.is_slack(c)) return Matrix::Zero(gradient.size(), gradient.size());
    const auto g = gradient.reshaped();
    k = g * g.transpose();
    if constexpr (HasHessian<Kind>)
      if (!bare) k += profile.strain(c) * kind.hessian(points);
  } else {
    k = kind.energy_hessian(points);
    if (model != StiffnessModel::taut && !profile.is_plain()) {
      const Real c = std::sqrt(2 * std::max<Real>(kind.energy_and_gradient(points, gradient), 0));
      if (profile.is_slack(c) || !(c > 0)) return Matrix::Zero(gradient.size(), gradient.size());
      // With dC = dpsi / C: d²E = K (dC dCᵀ + s d²C), d²C = (d²psi - dC dCᵀ) / C.
      const Real share = profile.strain(c) / c;
      gradient /= c;
      const auto g = gradient.reshaped();
      k = share * k + (1 - share) * (g * g.transpose());
    }
  }
  k *= stiffness;
  const bool project = ElasticEnergy<Kind> ? model != StiffnessModel::exact : model == StiffnessModel::psd_projected;
  return project ? psd_projection(k) : k;
}

/// Damping along the gradient, F_i = -d (dC/dt) dC/dp_i with dC/dt = sum_j dC/dp_j . v_j [N]: it opposes only the
/// motion that changes C, so it has no net force and no net torque. `damping` d in joule seconds.
template <ElementKind Kind>
Gradient<Kind::num_points> damping_force(const Kind& kind, Real damping, const Points<Kind::num_points>& points,
                                         const Points<Kind::num_points>& velocities) {
  if constexpr (Constraint<Kind>) {
    const Gradient<Kind::num_points> gradient = kind.gradient(points);
    return gradient * (-damping * gradient.cwiseProduct(velocities).sum());
  } else if constexpr (HasDampingModes<Kind>) {
    Gradient<Kind::num_points> force = Gradient<Kind::num_points>::Zero(3, points.cols());
    kind.visit_damping_modes(points, [&](Real weight, const Gradient<Kind::num_points>& gradient) {
      force -= damping * weight * gradient.cwiseProduct(velocities).sum() * gradient;
    });
    return force;
  } else if constexpr (HasRigidDamping<Kind>) {
    return kind.damping_force(points, velocities, damping);
  } else {
    Gradient<Kind::num_points> gradient(3, points.cols());
    const Real psi = kind.energy_and_gradient(points, gradient);  // dC = dpsi / C, C² = 2 psi
    const Real scale = psi > 0 ? -damping * gradient.cwiseProduct(velocities).sum() / (2 * psi) : 0;
    return gradient * scale;
  }
}

}  // namespace penalty
