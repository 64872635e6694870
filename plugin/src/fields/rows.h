// One particle a register: x, y, z and what pads them. For the loops that a step spends its time in, compiled for
// processors with AVX2; whoever uses it asks `are_supported` first and has a plain loop beside it.
#pragma once
#include <cstddef>

#include "../math/processors.h"
#include "penalty/math/types.h"

#ifdef PENALTY_HAS_AVX2
#include <immintrin.h>

namespace penalty::rows {

/// Whether processor and system have what this is compiled for.
inline bool are_supported() {
  static const bool supported = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return supported;
}

}  // namespace penalty::rows

PENALTY_BEGIN_AVX2

namespace penalty::rows {

using Row = Real __attribute__((vector_size(32)));

// Particles are aligned to 16 bytes, and some of what is read is between them.
[[gnu::always_inline]] inline Row load(const Real* p) { return _mm256_loadu_pd(p); }
[[gnu::always_inline]] inline void store(Real* p, Row row) { _mm256_storeu_pd(p, row); }
[[gnu::always_inline]] inline Row load(const Real* vectors, int i) {
  return load(vectors + 4 * static_cast<std::size_t>(i));
}
[[gnu::always_inline]] inline void add(Real* vectors, int i, Row row) {
  store(vectors + 4 * static_cast<std::size_t>(i), load(vectors, i) + row);
}
[[gnu::always_inline]] inline void subtract(Real* vectors, int i, Row row) {
  store(vectors + 4 * static_cast<std::size_t>(i), load(vectors, i) - row);
}

[[gnu::always_inline]] inline Row yzx(Row a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }

[[gnu::always_inline]] inline Row zxy(Row a) { return __builtin_shufflevector(a, a, 2, 0, 1, 3); }

/// b x c, of which the callers have `yzx` already.
[[gnu::always_inline]] inline Row cross(Row b, Row turned_b, Row c, Row turned_c) {
  return yzx(b * turned_c - turned_b * c);
}

/// Four vectors by their components.
struct Columns {
  Row x, y, z;

  [[gnu::always_inline]] explicit Columns(const Row (&vectors)[4]) {
    const auto& [a, b, c, d] = vectors;
    const Row xz_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6), xz_cd = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    const Row y_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7), y_cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    x = __builtin_shufflevector(xz_ab, xz_cd, 0, 1, 4, 5);
    y = __builtin_shufflevector(y_ab, y_cd, 0, 1, 4, 5);
    z = __builtin_shufflevector(xz_ab, xz_cd, 2, 3, 6, 7);
  }

  [[gnu::always_inline]] Row sums() const { return x + y + z; }
  [[gnu::always_inline]] Row squares() const { return x * x + y * y + z * z; }
};

[[gnu::always_inline]] inline Row square_roots(Row a) { return _mm256_sqrt_pd(a); }

/// Whether all comparisons of four are true.
template <class Mask>
[[gnu::always_inline]] inline bool all(Mask mask) {
  return _mm256_movemask_pd(reinterpret_cast<__m256d>(mask)) == 15;
}

template <std::size_t apart>
[[gnu::always_inline]] inline Row load_four(const Real* p) {
  const Row row = {p[0], p[apart], p[2 * apart], p[3 * apart]};
  return row;
}

}  // namespace penalty::rows

PENALTY_END_AVX2
#endif
