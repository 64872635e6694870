// What the recovery tests share.
#pragma once
#include <bit>
#include <cstdint>

#include "penalty/math/types.h"

namespace penalty::demo {

inline constexpr Real recovered_below = 1e-2;  // rest error

/// FNV-1a over the bits of the positions: equal if and only if every bit is, but for accidents.
inline std::uint64_t hash_of(const PackedVectors& x) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const Real value : x.reshaped()) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (int shift = 0; shift < 64; shift += 8) hash = (hash ^ ((bits >> shift) & 0xff)) * 0x100000001b3;
  }
  return hash;
}

}  // namespace penalty::demo
