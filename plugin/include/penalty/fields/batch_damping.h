// The damping of a batch: part of batch_loops.h.
#pragma once
#include "penalty/fields/batch_loops.h"

namespace penalty {

/// Calls visit(weight, gradient) for the modes that an element damps, with their weights in units of its damping;
/// `gradient` is to work in.
template <ElementKind Kind, class Visit>
[[gnu::always_inline]] inline void visit_modes(const Kind& kind, const Points<Kind::num_points>& points,
                                               Gradient<Kind::num_points>& gradient, const Visit& visit) {
  if constexpr (Constraint<Kind>) {
    value_and_gradient(kind, points, gradient);
    visit(1, gradient);
  } else if constexpr (HasDampingModes<Kind>) {
    kind.visit_damping_modes(points, visit);
  } else {
    const Real psi = kind.energy_and_gradient(points, gradient);
    visit(psi > 0 ? 1 / (2 * psi) : 0, gradient);
  }
}

/// Adds the modes of an element to `modes`, or counts them.
template <ElementKind Kind, class Stencil>
[[gnu::always_inline]] inline void add_modes(const Kind& kind, const Stencil& stencil, Real damping,
                                             const Points<Kind::num_points>& points,
                                             Gradient<Kind::num_points>& gradient, DampingModes& modes) {
  constexpr int num_points = Kind::num_points;
  int i = 0, j = 1;  // the edge whose turn it is
  visit_modes(kind, points, gradient,
              [&](Real weight, const Gradient<num_points>& mode) __attribute__((always_inline)) {
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

/// Adds the modes of `size` plain elements; `times` [s], if there are any, are theirs on top of `time`.
template <ElementKind Kind>
[[gnu::always_inline]] inline void add_element_modes(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, const Real* times, std::size_t size, const Real* x, Real time, Real duration,
    DampingModes& modes) {
  for (std::size_t e = 0; e < size; ++e) {
    Points<Kind::num_points> points;
    Gradient<Kind::num_points> gradient;
    gather_points(stencils[e], x, points);
    add_modes(kinds[e], stencils[e], (times ? time + times[e] : time) * duration * stiffnesses[e], points, gradient,
              modes);
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_damping_modes(const Positions& x, Real time, Real duration, DampingModes& modes) const {
  if constexpr (!HasRigidDamping<Kind>) {
    if constexpr (num_points != dynamic && is_own_kind<Kind>) {
      if (is_plain() && !modes.is_counting())
        return detail::add_own_element_modes(stencils_.data(), kinds_.data(), stiffnesses_.data(), damping_times(),
                                             stencils_.size(), x.data(), time, duration, modes);
    }
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      auto&& s = scratch(e);
      gather(e, x, s.points);
      const Real damping = is_slack(e, s.points) ? 0 : damping_time(e, time) * duration * stiffnesses_[e];
      add_modes(kinds_[e], stencils_[e], damping, s.points, s.gradient, modes);
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
      visit_modes(kinds_[e], s.points, s.gradient, add_term);
    } else {
      Hessian<num_points> d = Hessian<num_points>::Zero();
      visit_modes(kinds_[e], s.points, s.gradient, [&](Real weight, const Gradient<num_points>& mode) {
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
      visit_modes(kinds_[e], s.points, s.gradient, [&](Real weight, const Gradient<num_points>& gradient) {
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
