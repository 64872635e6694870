#include "main/readable.h"

#include <array>
#include <cstdio>

namespace penalty::demo {

std::string readable(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

}  // namespace penalty::demo
