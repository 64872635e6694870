// The damping of a batch: part of batch_loops.h.
#pragma once
#include "penalty/fields/batch_loops.h"

namespace penalty {

template <ElementKind Kind>
template <class Visit>
void Batch<Kind>::visit_damping_modes(std::size_t e, Scratch& s, const Visit& visit) const {
  if constexpr (Constraint<Kind>) {
    value_and_gradient(kinds_[e], s.points, s.gradient);
    visit(1, s.gradient);
  } else if constexpr (HasDampingModes<Kind>) {
    kinds_[e].visit_damping_modes(s.points, visit);
  } else {
    const Real psi = kinds_[e].energy_and_gradient(s.points, s.gradient);
    visit(psi > 0 ? 1 / (2 * psi) : 0, s.gradient);
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_damping_modes(const Positions& x, Real time, Real duration, DampingModes& modes) const {
  if constexpr (!HasRigidDamping<Kind>) {
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      auto&& s = scratch(e);
      gather(e, x, s.points);
      const Stencil& stencil = stencils_[e];
      const Real damping = is_slack(e, s.points) ? 0 : damping_time(e, time) * duration * stiffnesses_[e];
      int i = 0, j = 1;  // the edge whose turn it is
      visit_damping_modes(e, s, [&](Real weight, const Gradient<num_points>& mode) {
        if constexpr (damps_edges<Kind>) {
          if (i < num_points - 1) {
            if (modes.is_counting())
              modes.count(std::array{stencil[i], stencil[j]}, true);
            else
              modes.add(damping * weight, mode.template middleCols<1>(i));
            if (++j == num_points) j = ++i + 1;
            return;
          }
        }
        if (modes.is_counting())
          modes.count(stencil, conserves_momentum<Kind>);
        else
          modes.add(damping * weight, mode);
      });
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_damping(const Positions& x, Real time, System& system) const {
  if (system.is_counting()) return count(system);
  for_each_damped(x, time, 1, [&](std::size_t e, auto& s, Real damping) {
    const Stencil& stencil = stencils_[e];
    const auto add_term = [&](Real weight, const Gradient<num_points>& mode) {
      system.add_term(damping * weight, stencil, mode);
    };
    if constexpr (HasRigidDamping<Kind>) {
      kinds_[e].visit_damping(
          s.points,
          [&](int i, Real value) { system.add_block(stencil[i], stencil[i], Matrix3::Identity() * (damping * value)); },
          add_term);
    } else if constexpr (num_points == dynamic) {
      visit_damping_modes(e, s, add_term);
    } else {
      Hessian<num_points> d = Hessian<num_points>::Zero();
      visit_damping_modes(e, s, [&](Real weight, const Gradient<num_points>& mode) {
        d.noalias() += (damping * weight) * mode.reshaped() * mode.reshaped().transpose();
      });
      system.add_dense(stencil, d);
    }
  });
}

template <ElementKind Kind>
void Batch<Kind>::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                            Forces v) const {
  for_each_damped(x, time, duration, [&](std::size_t e, auto& s, Real damping) {
    const Stencil& stencil = stencils_[e];
    if constexpr (HasRigidDamping<Kind>) {
      for (std::size_t k = 0; k < stencil.size(); ++k) s.inverse_masses[k] = inverse_masses[stencil[k]];
      gather_points(stencil, v.data(), s.vectors);
      kinds_[e].damp(s.points, s.inverse_masses, damping, s.vectors);
      for (std::size_t k = 0; k < stencil.size(); ++k)
        v.col(stencil[k]).template head<3>() = s.vectors.col(static_cast<Eigen::Index>(k));
    } else {
      visit_damping_modes(e, s, [&](Real weight, const Gradient<num_points>& gradient) {
        Real rate = 0, mobility = 0;  // dC/dt and dC M^-1 dCᵀ
        for (Eigen::Index k = 0; k < gradient.cols(); ++k) {
          rate += gradient.col(k).dot(v.col(stencil[k]).template head<3>());
          mobility += inverse_masses[stencil[k]] * gradient.col(k).squaredNorm();
        }
        const Real impulse = -damping * weight * rate / (1 + damping * weight * mobility);
        for (Eigen::Index k = 0; k < gradient.cols(); ++k)
          v.col(stencil[k]).template head<3>() += inverse_masses[stencil[k]] * impulse * gradient.col(k);
      });
    }
  });
}

}  // namespace penalty
