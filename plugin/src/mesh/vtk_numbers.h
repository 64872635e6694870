// Numbers in VTK's files: their types, and their bytes in either order.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace penalty {

struct NumberType {
  enum class Sort : std::uint8_t { floating, whole, natural } sort;
  std::size_t size;  // 1, 2, 4 or 8 bytes, floating 4 or 8
};

namespace detail {

template <class T, class Out>
Out number_at(const char* bytes, std::endian order) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (order != std::endian::native) std::reverse(raw.begin(), raw.end());
  return static_cast<Out>(std::bit_cast<T>(raw));
}

template <class Whole, class Natural, class Out>
Out integer_at(const char* bytes, bool is_natural, std::endian order) {
  return is_natural ? number_at<Natural, Out>(bytes, order) : number_at<Whole, Out>(bytes, order);
}

}  // namespace detail

template <class Out>
Out number_at(const char* bytes, NumberType type, std::endian order) {
  if (type.sort == NumberType::Sort::floating)
    return type.size == 4 ? detail::number_at<float, Out>(bytes, order) : detail::number_at<double, Out>(bytes, order);
  const bool is_natural = type.sort == NumberType::Sort::natural;
  switch (type.size) {
    case 1:
      return detail::integer_at<std::int8_t, std::uint8_t, Out>(bytes, is_natural, order);
    case 2:
      return detail::integer_at<std::int16_t, std::uint16_t, Out>(bytes, is_natural, order);
    case 4:
      return detail::integer_at<std::int32_t, std::uint32_t, Out>(bytes, is_natural, order);
    default:
      return detail::integer_at<std::int64_t, std::uint64_t, Out>(bytes, is_natural, order);
  }
}

}  // namespace penalty
