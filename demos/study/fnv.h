// A hash of bits: the same numbers, the same hash, on every machine of one byte order.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

namespace penalty::study {

/// FNV-1a, 64 bits.
class Fnv {
 public:
  void add(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t k = 0; k < size; ++k) hash_ = (hash_ ^ bytes[k]) * 0x100000001b3u;
  }
  std::uint64_t value() const { return hash_; }
  std::string hex() const {
    std::string text(16, '0');
    for (std::size_t k = 0; k < 16; ++k) text[k] = "0123456789abcdef"[hash_ >> (60 - 4 * k) & 15];
    return text;
  }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace penalty::study
