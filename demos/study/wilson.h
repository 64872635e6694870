// How much a count of successes says about the rate behind it.
#pragma once
#include <cmath>

#include "penalty/math/types.h"

namespace penalty::study {

struct Interval {
  Real low, high;
};

/// The Wilson score interval of 95 % for `successes` in `runs` > 0. Unlike the normal approximation it says something
/// sensible about none and all.
inline Interval wilson_interval(int successes, int runs) {
  constexpr Real z = 1.959963984540054;  // 97.5 % of a normal distribution lie below
  const Real n = runs, p = successes / n, scale = 1 / (1 + z * z / n);
  const Real middle = scale * (p + z * z / (2 * n));
  const Real half = scale * z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {successes == 0 ? 0 : middle - half, successes == runs ? 1 : middle + half};
}

}  // namespace penalty::study
