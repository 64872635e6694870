#include "penalty/fields/damping_modes.h"

#include <algorithm>
#include <numeric>

#include "damping_rows.h"

namespace penalty {
namespace {

Triple load(const Real* p) { return {p[0], p[1], p[2]}; }
void increase(Real* p, const Triple& t) {
  p[0] += t.x;
  p[1] += t.y;
  p[2] += t.z;
}

}  // namespace

void DampingModes::count(std::span<const int> stencil, bool cancels) {
  const int size = cancels && stencil.size() >= 2 && stencil.size() <= 4 ? static_cast<int>(stencil.size()) : other;
  if (size == other) {
    places_.push_back({other, static_cast<int>(others_.begins.size()) - 1});
    others_.particles.insert(others_.particles.end(), stencil.begin(), stencil.end());
    others_.begins.push_back(others_.particles.size());
  } else if (size == 2) {
    places_.push_back({2, static_cast<int>(pairs_.size())});
    pairs_.push_back({std::min(stencil[0], stencil[1]), std::max(stencil[0], stencil[1])});
  } else {
    places_.push_back({size, static_cast<int>(particles_.size())});
    particles_.insert(particles_.end(), stencil.begin(), stencil.end());
  }
}

void DampingModes::end_counting() {
  is_counting_ = false;
  const auto for_each_pair_of_few = [this](const auto& visit) {
    for (const Place& place : places_)
      for (int a = place.index; place.size > 2 && a < place.index + place.size; ++a)
        for (int b = a + 1; b < place.index + place.size; ++b)
          particles_[a] < particles_[b] ? visit(a, b) : visit(b, a);
  };
  std::vector<std::array<int, 2>> blocks = pairs_;
  for_each_pair_of_few([&](int a, int b) { blocks.push_back({particles_[a], particles_[b]}); });
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());

  blocks_.begins.assign(blocks.empty() ? 1 : blocks.back()[0] + 2, 0);
  for (const auto& [i, j] : blocks) {
    ++blocks_.begins[i + 1];
    blocks_.columns.push_back(j);
  }
  std::partial_sum(blocks_.begins.begin(), blocks_.begins.end(), blocks_.begins.begin());
  const auto block_of = [&](int i, int j) {
    const auto row = blocks_.columns.begin();
    return std::lower_bound(row + blocks_.begins[i], row + blocks_.begins[i + 1], j) - row;
  };
  for (Place& place : places_)
    if (place.size == 2) place.index = static_cast<int>(block_of(pairs_[place.index][0], pairs_[place.index][1]));
  pairs_ = {};
  blocks_.values.resize(9 * blocks.size() + 1);
  blocks_.along.resize(blocks.size());
  blocks_.directions.resize(blocks.size());

  std::vector<std::size_t>& begins = blocks_.product_begins;
  begins.assign(blocks.size() + 2, 0);
  for_each_pair_of_few([&](int a, int b) { ++begins[block_of(particles_[a], particles_[b]) + 2]; });
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  blocks_.products.resize(begins.back());
  for_each_pair_of_few(
      [&](int a, int b) { blocks_.products[begins[block_of(particles_[a], particles_[b]) + 1]++] = {a, b}; });
  begins.pop_back();

  gradients_.resize(particles_.size());
  others_.weights.resize(others_.begins.size() - 1);
  others_.gradients.resize(3 * others_.particles.size());
}

void DampingModes::begin() {
  next_ = 0;
  std::fill(blocks_.along.begin(), blocks_.along.end(), 0);
}

void DampingModes::end() {
  if (is_counting_) return;
  const DampingSummands from{.along = blocks_.along.data(),
                             .directions = blocks_.directions.data(),
                             .begins = blocks_.product_begins.data(),
                             .products = blocks_.products.data(),
                             .gradients = gradients_.data()};
#ifdef PENALTY_HAS_AVX2
  if (rows::are_supported()) return rows::sum_blocks(from, blocks_.columns.size(), blocks_.values.data());
#endif
  sum_blocks(from, blocks_.columns.size(), blocks_.values.data());
}

void DampingModes::add_product(const Vectors& v, Forces out) const {
  const DampingBlocks blocks{.num_rows = blocks_.begins.size() - 1,
                             .begins = blocks_.begins.data(),
                             .columns = blocks_.columns.data(),
                             .values = blocks_.values.data()};
#ifdef PENALTY_HAS_AVX2
  if (rows::are_supported())
    rows::add_block_products(blocks, v.data(), out.data());
  else
#endif
    add_block_products(blocks, v.data(), out.data());
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
  // Both gradients of a mode along a line are as long.
  for (std::size_t i = 0; i + 1 < blocks_.begins.size(); ++i)
    for (std::size_t k = blocks_.begins[i]; k < blocks_.begins[i + 1]; ++k) {
      bounds[i] += 2 * blocks_.along[k];
      bounds[blocks_.columns[k]] += 2 * blocks_.along[k];
    }
  const auto add = [&bounds](std::span<const int> particles, Real weight, const auto& gradient) {
    Real total = 0;
    for (std::size_t i = 0; i < particles.size(); ++i) total += weight / 2 * dot(gradient(i), gradient(i));
    for (std::size_t i = 0; i < particles.size(); ++i)
      bounds[particles[i]] +=
          static_cast<Real>(particles.size()) * (weight / 2) * dot(gradient(i), gradient(i)) + total;
  };
  for (const Place& place : places_)
    if (place.size > 2)
      add(std::span(particles_).subspan(place.index, place.size), 1,
          [&](std::size_t i) { return load(gradients_[place.index + i].data()); });
  for (std::size_t k = 0; k < others_.weights.size(); ++k)
    add(std::span(others_.particles).subspan(others_.begins[k], others_.begins[k + 1] - others_.begins[k]),
        others_.weights[k], [&](std::size_t i) { return load(&others_.gradients[3 * (others_.begins[k] + i)]); });
}

}  // namespace penalty
