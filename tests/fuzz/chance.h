// What a random sequence of calls draws from.
#pragma once
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>

#include "penalty/math/types.h"

namespace penalty::testing {

enum class Manner {
  legal,    // as the headers ask: no call may be refused, and what is to be conserved must be
  extreme,  // numbers of any size, and none, in calls that are legal otherwise: they may be refused
  misuse    // also calls in the wrong order, bodies that vanish, callables that throw
};

/// The same on every machine for the same seed.
class Chance {
 public:
  explicit Chance(std::uint64_t start) : engine_(start) {}

  Manner manner = Manner::legal;

  int index(int size) { return size < 2 ? 0 : static_cast<int>(engine_() % static_cast<unsigned>(size)); }
  bool one_in(int count) { return index(count) == 0; }
  Real uniform(Real low, Real high) { return low + (high - low) * static_cast<Real>(engine_() >> 11) * 0x1p-53; }

  /// In [low, high]; unless the manner is legal, one time in eight anything.
  Real number(Real low, Real high) { return manner != Manner::legal && one_in(8) ? anything() : uniform(low, high); }

  Real anything() {
    ++odd_numbers_;
    constexpr Real nan = std::numeric_limits<Real>::quiet_NaN(), inf = std::numeric_limits<Real>::infinity();
    constexpr Real all[] = {nan, inf, -inf, 1e300, -1e300, 1e150, 1e40,  1e38, -1e30, 1e18,  1e9,    -1e9,
                            0,   -0., 1,    -1,    0.5,    2,     -1e-3, 1e-9, 1e-30, 1e-45, 1e-310, 5e-324};
    return all[index(static_cast<int>(std::size(all)))];
  }

  /// How often `anything` was drawn.
  int odd_numbers() const { return odd_numbers_; }

  template <class List>
  auto& pick(List& list) {
    return list[static_cast<std::size_t>(index(static_cast<int>(std::size(list))))];
  }

 private:
  std::mt19937_64 engine_;
  int odd_numbers_ = 0;
};

}  // namespace penalty::testing
