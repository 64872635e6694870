// The loop that every step spends its time in: gather, evaluate, scatter.
#pragma once
#include <array>
#include <cstddef>

#include "penalty/constraints/constraint.h"
#include "penalty/math/triple.h"

namespace penalty {

template <int N>
[[gnu::always_inline]] inline Points<N> gather(const std::array<int, N>& stencil, const Real* vectors) {
  Points<N> points;
  for (int k = 0; k < N; ++k) {
    const Real* p = vectors + 4 * static_cast<std::size_t>(stencil[k]);
    Triple{p[0], p[1], p[2]}.store(points, k);
  }
  return points;
}

/// vectors += scale * values, point by point.
template <int N>
[[gnu::always_inline]] inline void scatter(const std::array<int, N>& stencil, const Gradient<N>& values, Real scale,
                                           Real* vectors) {
  for (int k = 0; k < N; ++k) {
    Real* p = vectors + 4 * static_cast<std::size_t>(stencil[k]);
    for (int axis = 0; axis < 3; ++axis) p[axis] += scale * values(axis, k);
  }
}

/// f += -K C dC for `size` elements; returns their energy. `x` and `f` are packed, four reals a particle.
template <Constraint Kind>
[[gnu::always_inline]] inline Real add_penalty_forces(const std::array<int, Kind::num_points>* stencils,
                                                      const Kind* kinds, const Real* stiffnesses, std::size_t size,
                                                      const Real* x, Real* f) {
  Real twice_energy = 0;
  for (std::size_t e = 0; e < size; ++e) {
    Gradient<Kind::num_points> gradient;
    const Real c = value_and_gradient(kinds[e], gather<Kind::num_points>(stencils[e], x), gradient);
    const Real kc = stiffnesses[e] * c;
    twice_energy += kc * c;
    scatter<Kind::num_points>(stencils[e], gradient, -kc, f);
  }
  return twice_energy / 2;
}

}  // namespace penalty
