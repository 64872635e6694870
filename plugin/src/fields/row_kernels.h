// Forces of the elements that bodies are made of, one particle a register: x, y, z and what pads them. Nothing is
// transposed but what is summed over x, y and z, four elements at a time, so that elements stay in mesh order. The
// reference is `add_element_forces`, which takes what is left over and every other processor.
#pragma once
#include "penalty/fields/kernel.h"
#include "penalty/kinds/kinds.h"
#include "rows.h"

#ifdef PENALTY_HAS_AVX2
PENALTY_BEGIN_AVX2

namespace penalty::rows {

/// Places in the list between the four elements that are evaluated together. Neighbours would wait for each other to
/// store the forces of the particles that they share; so far apart there are hardly any.
template <class Kind>
inline constexpr std::size_t apart_of = 16;
template <>
inline constexpr std::size_t apart_of<StableNeoHookean> = 1;  // enough to do between two stores

/// By the reference, where some of the four are degenerate.
template <std::size_t apart, class Stencil, class Kind>
[[gnu::noinline]] Row add_forces_of_each(const Stencil* stencils, const Kind* kinds, const Real* stiffnesses,
                                         const Real* x, Real* f) {
  Row sums;
  for (std::size_t k = 0; k < 4; ++k)
    sums[k] = 2 * add_element_forces(stencils + k * apart, kinds + k * apart, stiffnesses + k * apart, 1, x, f);
  return sums;
}

// Each of the following adds the forces of elements 0, apart, 2 apart and 3 apart, and returns K C² of each.

template <std::size_t apart>
[[gnu::always_inline]] inline Row add_forces_of_four(const std::array<int, 2>* stencils, const Length* kinds,
                                                     const Real* stiffnesses, const Real* x, Real* f) {
  Row edges[4];
  for (std::size_t k = 0; k < 4; ++k) edges[k] = load(x, stencils[k * apart][1]) - load(x, stencils[k * apart][0]);
  const Row inverses = {kinds[0].inverse_rest_length, kinds[apart].inverse_rest_length,
                        kinds[2 * apart].inverse_rest_length, kinds[3 * apart].inverse_rest_length};
  const Row lengths = square_roots(Columns(edges).squares());
  const Row ratios = lengths * inverses;
  if (!all(ratios > Length::smallest_ratio)) [[unlikely]]  // points that coincide
    return add_forces_of_each<apart>(stencils, kinds, stiffnesses, x, f);
  const Row c = ratios - 1, kc = load_four<apart>(stiffnesses) * c;
  const Row scales = kc * inverses / lengths;
  for (std::size_t k = 0; k < 4; ++k) {
    const Row force = edges[k] * scales[k];
    add(f, stencils[k * apart][0], force);
    subtract(f, stencils[k * apart][1], force);
  }
  return kc * c;
}

template <std::size_t apart>
[[gnu::always_inline]] inline Row add_forces_of_four(const std::array<int, 4>* stencils, const TetrahedronVolume* kinds,
                                                     const Real* stiffnesses, const Real* x, Real* f) {
  Row g1[4], g2[4], g3[4], volumes[4];  // dC/dp and the summands of C + 1, times 6V0
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2, i3] = stencils[k * apart];
    const Row p0 = load(x, i0), a = load(x, i1) - p0, b = load(x, i2) - p0, c = load(x, i3) - p0;
    const Row turned_a = yzx(a), turned_b = yzx(b), turned_c = yzx(c);
    g1[k] = cross(b, turned_b, c, turned_c);
    g2[k] = cross(c, turned_c, a, turned_a);
    g3[k] = cross(a, turned_a, b, turned_b);
    volumes[k] = a * g1[k];
  }
  const Row inverses = {kinds[0].inverse_rest_volume, kinds[apart].inverse_rest_volume,
                        kinds[2 * apart].inverse_rest_volume, kinds[3 * apart].inverse_rest_volume};
  const Row slopes = inverses * (1.0 / 6);
  const Row c = Columns(volumes).sums() * slopes - 1, kc = load_four<apart>(stiffnesses) * c;
  const Row scales = kc * slopes;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2, i3] = stencils[k * apart];
    const Row f1 = g1[k] * scales[k], f2 = g2[k] * scales[k], f3 = g3[k] * scales[k];
    subtract(f, i1, f1);
    subtract(f, i2, f2);
    subtract(f, i3, f3);
    add(f, i0, f1 + f2 + f3);
  }
  return kc * c;
}

template <std::size_t apart>
[[gnu::always_inline]] inline Row add_forces_of_four(const std::array<int, 3>* stencils, const TriangleArea* kinds,
                                                     const Real* stiffnesses, const Real* x, Real* f) {
  Row g1[4], g2[4], norms2[4], legs2[4];  // v x N and N x u, and the summands of |N|² and |u|² + |v|²
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2] = stencils[k * apart];
    const Row p0 = load(x, i0), u = load(x, i1) - p0, v = load(x, i2) - p0;
    const Row turned_u = yzx(u), turned_v = yzx(v);
    const Row normal = cross(u, turned_u, v, turned_v), turned_normal = yzx(normal);
    g1[k] = cross(v, turned_v, normal, turned_normal);
    g2[k] = cross(normal, turned_normal, u, turned_u);
    norms2[k] = normal * normal;
    legs2[k] = u * u + v * v;
  }
  const Row norm2 = Columns(norms2).sums(), limit = detail::smallest_sine * Columns(legs2).sums();
  if (!all(norm2 > limit * limit)) [[unlikely]]  // they may be thin
    return add_forces_of_each<apart>(stencils, kinds, stiffnesses, x, f);
  const Row inverses = {kinds[0].inverse_rest_area, kinds[apart].inverse_rest_area, kinds[2 * apart].inverse_rest_area,
                        kinds[3 * apart].inverse_rest_area};
  const Row norm = square_roots(norm2);
  const Row c = norm * inverses / 2 - 1, kc = load_four<apart>(stiffnesses) * c;
  const Row scales = kc * inverses / (2 * norm);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2] = stencils[k * apart];
    const Row f1 = g1[k] * scales[k], f2 = g2[k] * scales[k];
    subtract(f, i1, f1);
    subtract(f, i2, f2);
    add(f, i0, f1 + f2);
  }
  return kc * c;
}

// Returns zeros: the energy, of which the forces know nothing, is a loop of its own.
template <std::size_t apart>
[[gnu::always_inline]] inline Row add_forces_of_four(const std::array<int, 4>* stencils, const StableNeoHookean* kinds,
                                                     const Real* stiffnesses, const Real* x, Real* f) {
  Row f0[4], f1[4], f2[4], c0[4], c1[4], c2[4];  // columns of F and of dJ/dF
  Row invariants[4], dilations[4];               // summands of I and J
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2, i3] = stencils[k * apart];
    const Real* inverse = kinds[k * apart].inverse_rest.data();  // three columns of three
    const Row p0 = load(x, i0), a = load(x, i1) - p0, b = load(x, i2) - p0, c = load(x, i3) - p0;
    f0[k] = a * inverse[0] + b * inverse[1] + c * inverse[2];
    f1[k] = a * inverse[3] + b * inverse[4] + c * inverse[5];
    f2[k] = a * inverse[6] + b * inverse[7] + c * inverse[8];
    const Row turned_0 = yzx(f0[k]), turned_1 = yzx(f1[k]), turned_2 = yzx(f2[k]);
    c0[k] = cross(f1[k], turned_1, f2[k], turned_2);
    c1[k] = cross(f2[k], turned_2, f0[k], turned_0);
    c2[k] = cross(f0[k], turned_0, f1[k], turned_1);
    invariants[k] = f0[k] * f0[k] + f1[k] * f1[k] + f2[k] * f2[k];
    dilations[k] = f0[k] * c0[k];
  }
  const Row invariant = Columns(invariants).sums(), dilation = Columns(dilations).sums() - 1;
  const Row bulk = {kinds[0].bulk(), kinds[apart].bulk(), kinds[2 * apart].bulk(), kinds[3 * apart].bulk()};
  const Row stiffness = load_four<apart>(stiffnesses);
  const Row stretch = stiffness * StableNeoHookean::shear * (invariant / (invariant + 1));
  const Row swell = stiffness * (bulk * dilation - 1);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& [i0, i1, i2, i3] = stencils[k * apart];
    const Real* inverse = kinds[k * apart].inverse_rest.data();
    const Row p0 = f0[k] * stretch[k] + c0[k] * swell[k], p1 = f1[k] * stretch[k] + c1[k] * swell[k],
              p2 = f2[k] * stretch[k] + c2[k] * swell[k];
    const Row g1 = p0 * inverse[0] + p1 * inverse[3] + p2 * inverse[6],
              g2 = p0 * inverse[1] + p1 * inverse[4] + p2 * inverse[7],
              g3 = p0 * inverse[2] + p1 * inverse[5] + p2 * inverse[8];
    subtract(f, i1, g1);
    subtract(f, i2, g2);
    subtract(f, i3, g3);
    add(f, i0, g1 + g2 + g3);
  }
  return Row{};
}

template <class Stencil, class Kind>
Real add_forces(const Stencil* stencils, const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x,
                Real* f) {
  constexpr std::size_t apart = apart_of<Kind>;
  Row sum = {};
  std::size_t e = 0;
  for (; e + 4 * apart <= size; e += 4 * apart)
    for (std::size_t i = e; i < e + apart; ++i)
      sum += add_forces_of_four<apart>(stencils + i, kinds + i, stiffnesses + i, x, f);
  for (; e + 4 <= size; e += 4) sum += add_forces_of_four<1>(stencils + e, kinds + e, stiffnesses + e, x, f);
  if constexpr (HasEnergyGradient<Kind>) {
    add_element_forces_only(stencils + e, kinds + e, stiffnesses + e, size - e, x, f);
    return 0;
  } else {
    const Real rest = add_element_forces(stencils + e, kinds + e, stiffnesses + e, size - e, x, f);
    return (sum[0] + sum[1] + sum[2] + sum[3]) / 2 + rest;
  }
}

template <class Stencil, class Kind>
Real energy(const Stencil* stencils, const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x) {
  Real sum = 0;
  for (std::size_t e = 0; e < size; ++e) {
    Points<Kind::num_points> points;
    gather_points(stencils[e], x, points);
    sum += stiffnesses[e] * kinds[e].energy(points);
  }
  return sum;
}

}  // namespace penalty::rows

PENALTY_END_AVX2

namespace penalty {

/// Whether there is a loop by rows for this kind.
template <ElementKind Kind>
inline constexpr bool has_rows = is_in<Kind, KindList<Length, TetrahedronVolume, TriangleArea, StableNeoHookean>>;

}  // namespace penalty

#else

namespace penalty {

template <ElementKind Kind>
inline constexpr bool has_rows = false;

namespace rows {

bool are_supported();
template <class Stencil, class Kind>
Real add_forces(const Stencil*, const Kind*, const Real*, std::size_t, const Real*, Real*);
template <class Stencil, class Kind>
Real energy(const Stencil*, const Kind*, const Real*, std::size_t, const Real*);

}  // namespace rows
}  // namespace penalty

#endif
