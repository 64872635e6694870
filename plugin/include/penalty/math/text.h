// Numbers as text. Never in the way of a locale.
#pragma once
#include <array>
#include <charconv>
#include <string>

#include "penalty/math/types.h"

namespace penalty {

namespace detail {

/// What std::to_chars makes of `value` in a given form. No double takes more than 24 characters in those below.
template <class... Form>
std::string number_text(Real value, Form... form) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value, form...).ptr};
}

}  // namespace detail

/// For people: up to six significant digits, whatever the size, so that a small number never reads as zero.
inline std::string to_text(Real value) { return detail::number_text(value, std::chars_format::general, 6); }

/// For files: the shortest text that reads back as the same double.
inline std::string exact_text(Real value) { return detail::number_text(value); }

}  // namespace penalty
