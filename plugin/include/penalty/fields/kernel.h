// The loop that every step spends its time in: gather, evaluate, scatter.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "penalty/energy/penalty_energy.h"
#include "penalty/math/triple.h"

namespace penalty {

/// `points` has the right number of columns already. `vectors` is packed, four reals a particle.
template <class Stencil, class Columns>
[[gnu::always_inline]] inline void gather_points(const Stencil& stencil, const Real* vectors, Columns& points) {
  for (std::size_t k = 0; k < stencil.size(); ++k) {
    const Real* p = vectors + 4 * static_cast<std::size_t>(stencil[k]);
    Triple{p[0], p[1], p[2]}.store(points, static_cast<int>(k));
  }
}

/// vectors += scale * values, point by point.
template <class Stencil, class Columns>
[[gnu::always_inline]] inline void scatter_points(const Stencil& stencil, const Columns& values, Real scale,
                                                  Real* vectors) {
  for (std::size_t k = 0; k < stencil.size(); ++k) {
    Real* p = vectors + 4 * static_cast<std::size_t>(stencil[k]);
    for (int axis = 0; axis < 3; ++axis) p[axis] += scale * values(axis, static_cast<Eigen::Index>(k));
  }
}

/// f += -dE/dp for `size` plain elements; returns their energy. `x` and `f` are packed, four reals a particle.
template <ElementKind Kind>
[[gnu::always_inline]] inline Real add_element_forces(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  Real sum = 0;
  for (std::size_t e = 0; e < size; ++e) {
    Points<Kind::num_points> points;
    Gradient<Kind::num_points> gradient;
    gather_points(stencils[e], x, points);
    if constexpr (Constraint<Kind>) {
      const Real c = value_and_gradient(kinds[e], points, gradient);
      const Real kc = stiffnesses[e] * c;
      sum += kc * c;
      scatter_points(stencils[e], gradient, -kc, f);
    } else {
      sum += stiffnesses[e] * kinds[e].energy_and_gradient(points, gradient);
      scatter_points(stencils[e], gradient, -stiffnesses[e], f);
    }
  }
  return Constraint<Kind> ? sum / 2 : sum;
}

/// The same without the energy, of kinds whose energy costs extra.
template <ElementKind Kind>
[[gnu::always_inline]] inline void add_element_forces_only(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  if constexpr (HasEnergyGradient<Kind>) {
    for (std::size_t e = 0; e < size; ++e) {
      Points<Kind::num_points> points;
      Gradient<Kind::num_points> gradient;
      gather_points(stencils[e], x, points);
      kinds[e].energy_gradient(points, gradient);
      scatter_points(stencils[e], gradient, -stiffnesses[e], f);
    }
  } else {
    add_element_forces(stencils, kinds, stiffnesses, size, x, f);
  }
}

}  // namespace penalty
