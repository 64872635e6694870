// Numbers in messages.
#pragma once
#include <array>
#include <cstdio>
#include <string>

#include "penalty/math/types.h"

namespace penalty {

/// Up to six significant digits, whatever the size: a small number never reads as zero.
inline std::string to_text(Real value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

}  // namespace penalty
