#include "penalty/fields/damping_modes.h"

#include <algorithm>
#include <map>
#include <utility>

namespace penalty {
namespace {

Triple load(const Real* p) { return {p[0], p[1], p[2]}; }
void increase(Real* p, const Triple& t) {
  p[0] += t.x;
  p[1] += t.y;
  p[2] += t.z;
}

// Four reals at once: a particle, or a gradient and its padding.
using Quadruple = Real __attribute__((vector_size(32), aligned(8), may_alias));

const Quadruple& quadruple(const Real* p) { return *reinterpret_cast<const Quadruple*>(p); }
Quadruple& quadruple(Real* p) { return *reinterpret_cast<Quadruple*>(p); }

// out += sum weight g (g . v) over modes of N particles, of which the last has minus the sum of the other gradients.
template <int N>
[[gnu::always_inline]] inline void add_products(const std::array<int, N>* stencils, const Real* weights,
                                                const std::array<Real, 4 * (N - 1)>* gradients, std::size_t size,
                                                const Real* v, Real* out) {
  for (std::size_t k = 0; k < size; ++k) {
    const std::array<int, N>& stencil = stencils[k];
    const Real* g = gradients[k].data();
    const std::size_t last = 4 * static_cast<std::size_t>(stencil[N - 1]);
    const Quadruple of_last = quadruple(v + last);
    Quadruple rates = quadruple(g) * (quadruple(v + 4 * static_cast<std::size_t>(stencil[0])) - of_last);
    for (int i = 1; i < N - 1; ++i)
      rates += quadruple(g + 4 * i) * (quadruple(v + 4 * static_cast<std::size_t>(stencil[i])) - of_last);
    const Real rate = weights[k] * (rates[0] + rates[1] + rates[2]);
    Quadruple sum{};
    for (int i = 0; i < N - 1; ++i) {
      const Quadruple impulse = quadruple(g + 4 * i) * rate;
      quadruple(out + 4 * static_cast<std::size_t>(stencil[i])) += impulse;
      sum += impulse;
    }
    quadruple(out + last) -= sum;
  }
}

template <int N>
void add_mode_bounds(const std::array<int, N>& stencil, Real weight, const std::array<Real, 4 * (N - 1)>& gradient,
                     std::span<Real> bounds) {
  std::array<Real, N> norms2;
  Triple sum{0, 0, 0};
  Real total = 0;
  for (int i = 0; i < N; ++i) {
    const Triple g = i < N - 1 ? load(gradient.data() + 4 * i) : -sum;
    sum = sum + g;
    norms2[i] = weight / 2 * dot(g, g);
    total += norms2[i];
  }
  for (int i = 0; i < N; ++i) bounds[stencil[i]] += N * norms2[i] + total;
}

}  // namespace

void DampingModes::count(std::span<const int> stencil, bool cancels) {
  const auto count_in = [&](auto& modes) {
    auto& own = modes.stencils.emplace_back();
    std::copy(stencil.begin(), stencil.end(), own.begin());
    places_.push_back({static_cast<int>(own.size()), static_cast<int>(modes.stencils.size()) - 1});
  };
  switch (cancels ? stencil.size() : 0) {
    case 2:
      return count_in(pairs_);
    case 3:
      return count_in(triples_);
    case 4:
      return count_in(quadruples_);
    default:
      places_.push_back({other, static_cast<int>(others_.begins.size()) - 1});
      others_.particles.insert(others_.particles.end(), stencil.begin(), stencil.end());
      others_.begins.push_back(others_.particles.size());
  }
}

void DampingModes::end_counting() {
  is_counting_ = false;
  // The first of equal pairs stays, in its place among the first of others.
  std::map<std::pair<int, int>, Place*> first;
  std::vector<std::array<int, 2>> pairs;
  for (Place& place : places_) {
    if (place.size != 2) continue;
    const auto& [i, j] = pairs_.stencils[place.index];
    const auto [found, is_new] = first.try_emplace(std::minmax(i, j), &place);
    if (is_new) {
      place.index = static_cast<int>(pairs.size());
      pairs.push_back({i, j});
    } else {
      if (found->second->size != shared) shared_pairs_.push_back(found->second->index);
      found->second->size = shared;
      place = *found->second;
    }
  }
  pairs_.stencils = std::move(pairs);
  pairs_.resize();
  triples_.resize();
  quadruples_.resize();
  others_.weights.resize(others_.begins.size() - 1);
  others_.gradients.resize(3 * others_.particles.size());
}

void DampingModes::begin() {
  next_ = 0;
  for (const int k : shared_pairs_) pairs_.weights[k] = 0;
}

// Until the end the weight is that of a gradient of length 1.
void DampingModes::add_shared(int index, Real weight, const Triple& g) {
  pairs_.weights[index] += weight * dot(g, g);
  pairs_.gradients[index] = {g.x, g.y, g.z, 0};
}

void DampingModes::end() {
  for (const int k : shared_pairs_) {
    const Triple g = load(pairs_.gradients[k].data());
    if (const Real norm2 = dot(g, g); norm2 > 0) pairs_.weights[k] /= norm2;
  }
}

// Compiled twice, as the loop over the forces is.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
[[gnu::target_clones("arch=x86-64-v3", "default")]]
#endif
void DampingModes::add_products_of_few(const Real* v, Real* out) const {
  add_products<2>(pairs_.stencils.data(), pairs_.weights.data(), pairs_.gradients.data(), pairs_.stencils.size(), v,
                  out);
  add_products<3>(triples_.stencils.data(), triples_.weights.data(), triples_.gradients.data(),
                  triples_.stencils.size(), v, out);
  add_products<4>(quadruples_.stencils.data(), quadruples_.weights.data(), quadruples_.gradients.data(),
                  quadruples_.stencils.size(), v, out);
}

void DampingModes::add_product(const Vectors& v, Forces out) const {
  add_products_of_few(v.data(), out.data());
  for (std::size_t k = 0; k < others_.weights.size(); ++k) {
    Real rate = 0;
    for (std::size_t i = others_.begins[k]; i < others_.begins[k + 1]; ++i)
      rate += dot(load(&others_.gradients[3 * i]), load(v.data() + 4 * static_cast<std::size_t>(others_.particles[i])));
    rate *= others_.weights[k];
    for (std::size_t i = others_.begins[k]; i < others_.begins[k + 1]; ++i)
      increase(out.data() + 4 * static_cast<std::size_t>(others_.particles[i]), load(&others_.gradients[3 * i]) * rate);
  }
}

void DampingModes::add_bounds(std::span<Real> bounds) const {
  const auto add = [&]<int N>(const Modes<N>& modes) {
    for (std::size_t k = 0; k < modes.stencils.size(); ++k)
      add_mode_bounds<N>(modes.stencils[k], modes.weights[k], modes.gradients[k], bounds);
  };
  add(pairs_);
  add(triples_);
  add(quadruples_);
  for (std::size_t k = 0; k < others_.weights.size(); ++k) {
    const auto norm2 = [&](std::size_t i) {
      const Triple g = load(&others_.gradients[3 * i]);
      return others_.weights[k] / 2 * dot(g, g);
    };
    const std::size_t begin = others_.begins[k], end = others_.begins[k + 1];
    Real total = 0;
    for (std::size_t i = begin; i < end; ++i) total += norm2(i);
    for (std::size_t i = begin; i < end; ++i)
      bounds[others_.particles[i]] += static_cast<Real>(end - begin) * norm2(i) + total;
  }
}

}  // namespace penalty
