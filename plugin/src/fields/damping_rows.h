// The loops over the blocks of a damping matrix, see DampingModes.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>

#include "penalty/math/triple.h"
#include "rows.h"

namespace penalty {

/// The blocks above the diagonal, block row by block row, nine reals each: xx yy zz, xz yx zy, xy yz zx. Whole rows of
/// memory then do for B d and for Bᵀ d.
struct DampingBlocks {
  std::size_t num_rows;
  const std::size_t* begins;
  const int* columns;
  const Real* values;  // and one more, read along with the last
};

/// What a block is the sum of: a mode along the line between its two particles, and products of gradients.
struct DampingSummands {
  const Real* along;  // w |g|²
  const std::array<Real, 4>* directions;
  const std::size_t* begins;
  const std::array<int, 2>* products;
  const std::array<Real, 4>* gradients;  // times sqrt(w)
};

/// Adds up to `num_blocks` blocks.
inline void sum_blocks(const DampingSummands& from, std::size_t num_blocks, Real* values) {
  for (std::size_t k = 0; k < num_blocks; ++k) {
    const auto [x, y, z] = Triple{from.directions[k][0], from.directions[k][1], from.directions[k][2]};
    const Real norm2 = x * x + y * y + z * z, w = norm2 > 0 ? -from.along[k] / norm2 : 0;
    Real sum[9] = {w * x * x, w * y * y, w * z * z, w * x * z, w * y * x, w * z * y, w * x * y, w * y * z, w * z * x};
    for (std::size_t p = from.begins[k]; p < from.begins[k + 1]; ++p) {
      const auto& g = from.gradients[from.products[p][0]];
      const auto& h = from.gradients[from.products[p][1]];
      for (std::size_t i = 0; i < 3; ++i) {
        sum[i] += g[i] * h[i];
        sum[3 + i] += g[i] * h[(i + 2) % 3];
        sum[6 + i] += g[i] * h[(i + 1) % 3];
      }
    }
    std::copy(std::begin(sum), std::end(sum), values + 9 * k);
  }
}

/// out += D v.
inline void add_block_products(const DampingBlocks& blocks, const Real* v, Real* out) {
  const auto load = [](const Real* p) { return Triple{p[0], p[1], p[2]}; };
  const auto add = [](Real* p, const Triple& t) {
    p[0] += t.x;
    p[1] += t.y;
    p[2] += t.z;
  };
  for (std::size_t i = 0; i < blocks.num_rows; ++i) {
    Triple sum{0, 0, 0};
    for (std::size_t k = blocks.begins[i]; k < blocks.begins[i + 1]; ++k) {
      const std::size_t j = 4 * static_cast<std::size_t>(blocks.columns[k]);
      const Real* b = blocks.values + 9 * k;
      const Triple d = load(v + j) - load(v + 4 * i);
      sum = sum + Triple{b[0] * d.x + b[6] * d.y + b[3] * d.z, b[4] * d.x + b[1] * d.y + b[7] * d.z,
                         b[8] * d.x + b[5] * d.y + b[2] * d.z};
      add(out + j, -Triple{b[0] * d.x + b[4] * d.y + b[8] * d.z, b[6] * d.x + b[1] * d.y + b[5] * d.z,
                           b[3] * d.x + b[7] * d.y + b[2] * d.z});
    }
    add(out + 4 * i, sum);
  }
}

}  // namespace penalty

#ifdef PENALTY_HAS_AVX2
PENALTY_BEGIN_AVX2

namespace penalty::rows {

inline void sum_blocks(const DampingSummands& from, std::size_t num_blocks, Real* values) {
  for (std::size_t k = 0; k < num_blocks; ++k) {
    const Row direction = load(from.directions[k].data()), squares = direction * direction;
    const Real norm2 = squares[0] + squares[1] + squares[2];
    const Row scaled = direction * (norm2 > 0 ? -from.along[k] / norm2 : 0);
    Row same = scaled * direction, before = scaled * zxy(direction), after = scaled * yzx(direction);
    for (std::size_t p = from.begins[k]; p < from.begins[k + 1]; ++p) {
      const Row g = load(from.gradients[from.products[p][0]].data()),
                h = load(from.gradients[from.products[p][1]].data());
      same += g * h;
      before += g * zxy(h);
      after += g * yzx(h);
    }
    // Each takes the first number of the next along, which is written after it.
    store(values + 9 * k, same);
    store(values + 9 * k + 3, before);
    store(values + 9 * k + 6, after);
  }
}

inline void add_block_products(const DampingBlocks& blocks, const Real* v, Real* out) {
  for (std::size_t i = 0; i < blocks.num_rows; ++i) {
    const Row at_i = load(v, static_cast<int>(i));
    Row sum = {};
    for (std::size_t k = blocks.begins[i]; k < blocks.begins[i + 1]; ++k) {
      const Row d = load(v, blocks.columns[k]) - at_i;
      const Row same = load(blocks.values + 9 * k), before = load(blocks.values + 9 * k + 3),
                after = load(blocks.values + 9 * k + 6);
      const Row diagonal = same * d;
      sum += diagonal + before * zxy(d) + after * yzx(d);
      subtract(out, blocks.columns[k], diagonal + zxy(after * d) + yzx(before * d));
    }
    add(out, static_cast<int>(i), sum);
  }
}

}  // namespace penalty::rows

PENALTY_END_AVX2
#endif
