// What a batch computes: a loop over its elements for each function of Potential. Kinds of your own need it included
// where they are added to a field; for those of the library it is compiled once.
#pragma once
#include "penalty/fields/batch.h"

namespace penalty {

namespace detail {
template <class Kind>
struct BatchLoops {};

/// `add_element_forces` and `add_element_forces_only`, compiled in the library for the processor that the program runs
/// on, four elements at a time where row_kernels.h has a loop for the kind; own kinds only.
template <ElementKind Kind>
Real add_own_element_forces(const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils,
                            const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x, Real* f);
template <ElementKind Kind>
void add_own_element_forces_only(const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils,
                                 const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x, Real* f);
template <ElementKind Kind>
void add_own_element_modes(const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils,
                           const Kind* kinds, const Real* stiffnesses, const Real* times, std::size_t size,
                           const Real* x, Real time, Real duration, DampingModes& modes);
}  // namespace detail

template <ElementKind Kind>
Real Batch<Kind>::energy(const Positions& x) const {
  Real sum = 0;
  for_each_enabled(
      x, [&](std::size_t e, auto& s) { sum += penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e)); });
  return sum;
}

template <ElementKind Kind>
Real Batch<Kind>::add_forces(const Positions& x, Forces f) const {
  if constexpr (num_points != dynamic) {
    if (is_plain()) {
      const Stencil* stencils = stencils_.data();
      const Kind* kinds = kinds_.data();
      if constexpr (is_own_kind<Kind>)
        return detail::add_own_element_forces(stencils, kinds, stiffnesses_.data(), stencils_.size(), x.data(),
                                              f.data());
      else
        return add_element_forces(stencils, kinds, stiffnesses_.data(), stencils_.size(), x.data(), f.data());
    }
  }
  Real sum = 0;
  for_each_enabled(x, [&](std::size_t e, auto& s) {
    sum += energy_and_gradient(kinds_[e], stiffnesses_[e], s.points, profile(e), s.gradient);
    scatter(e, s.gradient, -1, f);
  });
  return sum;
}

template <ElementKind Kind>
void Batch<Kind>::add_forces_only(const Positions& x, Forces f) const {
  if constexpr (num_points != dynamic) {
    if (is_plain()) {
      const Stencil* stencils = stencils_.data();
      const Kind* kinds = kinds_.data();
      const std::size_t size = stencils_.size();
      if constexpr (is_own_kind<Kind>)
        detail::add_own_element_forces_only(stencils, kinds, stiffnesses_.data(), size, x.data(), f.data());
      else
        add_element_forces_only(stencils, kinds, stiffnesses_.data(), size, x.data(), f.data());
      return;
    }
  }
  Batch::add_forces(x, f);
}

template <ElementKind Kind>
Real Batch<Kind>::evolve(const Positions& x, Real duration) {
  if (!evolves()) return 0;
  Real taken = 0;
  for_each_enabled(
      x, [&](std::size_t e, auto& s) { taken += evolve_element(e, deviation(kinds_[e], s.points), duration); });
  return taken;
}

template <ElementKind Kind>
void Batch<Kind>::visit_elements(const Positions& x, const ElementVisitor& visit) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    ElementView view{
        .number = static_cast<int>(e), .stencil = stencils_[e], .strain = 0, .energy = 0, .enabled = !is_off(e)};
    if (view.enabled) {
      auto&& s = scratch(e);
      gather(e, x, s.points);
      const auto [strain, energy] = strain_and_energy(kinds_[e], stiffnesses_[e], s.points, profile(e));
      view.strain = strain;
      view.energy = energy;
    }
    visit(view);
  }
}

}  // namespace penalty

#include "penalty/fields/batch_damping.h"
#include "penalty/fields/batch_stiffness.h"
