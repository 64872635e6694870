// The second derivatives of a batch: part of batch_loops.h.
#pragma once
#include "penalty/fields/batch_loops.h"

namespace penalty {

/// Blocks and rank-one terms of one element; the sum of both is its stiffness.
template <ElementKind Kind>
template <class VisitBlock, class VisitTerm>
void Batch<Kind>::visit_structured(std::size_t e, Scratch& s, StiffnessModel model, const VisitBlock& visit_block,
                                   const VisitTerm& visit_term) const {
  const Kind& kind = kinds_[e];
  const Real k = stiffnesses_[e];
  const Profile profile = this->profile(e);
  if constexpr (Constraint<Kind>) {
    const Real c = value_and_gradient(kind, s.points, s.gradient);
    if (is_slack(e, c, model)) return;
    visit_term(k, s.gradient);
    // The Hessian of a constraint of many points is projected as a whole or not at all: psd leaves it out.
    if constexpr (HasSparseHessian<Kind>)
      if (model == StiffnessModel::exact)
        kind.visit_hessian_blocks(
            s.points, [&](int i, int j, const Matrix3& block) { visit_block(i, j, k * profile.strain(c) * block); });
  } else {
    const Real psi = kind.energy_and_gradient(s.points, s.gradient);
    const Real c = std::sqrt(2 * std::max<Real>(psi, 0));
    if (is_slack(e, c, model)) return;
    Real share = 1;
    if (!profile.is_plain() && model != StiffnessModel::taut) {
      if (!(c > 0)) return;
      share = profile.strain(c) / c;
      if (share < 0 && model != StiffnessModel::exact) share = 0;
      if (share < 1) visit_term(k * (1 - share) / (c * c), s.gradient);
    }
    kind.visit_stiffness(
        s.points, model != StiffnessModel::exact,
        [&](int i, Real value) { visit_block(i, i, Matrix3::Identity() * (k * share * value)); },
        [&](Real coefficient, const Gradient<num_points>& mode) { visit_term(k * share * coefficient, mode); });
  }
}

template <ElementKind Kind>
void Batch<Kind>::count(System& system) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Stencil& stencil = stencils_[e];
    if constexpr (!is_structured)
      system.count_dense(stencil);
    else if constexpr (HasSparseHessian<Kind>)
      kinds_[e].visit_hessian_pattern([&](int i, int j) { system.count(stencil[i], stencil[j]); });
    // The diagonal is in every pattern.
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_stiffness(const Positions& x, StiffnessModel model, System& system) const {
  if (system.is_counting()) return count(system);
  for_each_enabled(x, [&](std::size_t e, auto& s) {
    const Stencil& stencil = stencils_[e];
    if constexpr (is_structured) {
      visit_structured(
          e, s, model, [&](int i, int j, const Matrix3& block) { system.add_block(stencil[i], stencil[j], block); },
          [&](Real coefficient, const Gradient<num_points>& mode) { system.add_term(coefficient, stencil, mode); });
    } else {
      const Hessian<num_points> k = stiffness_matrix(kinds_[e], stiffnesses_[e], s.points, model, profile(e));
      system.add_dense(stencil, k);
    }
  });
}

}  // namespace penalty
