// Pixels, and their way into a PNG file.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace penalty::render {

/// 8-bit sRGB, rows from top to bottom.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // 3 * width * height

  Image() = default;
  /// Black. Throws std::invalid_argument unless both sizes are positive.
  Image(int width, int height);

  std::array<int, 3> pixel(int x, int y) const {
    const std::uint8_t* p = &rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x)];
    return {p[0], p[1], p[2]};
  }
};

using Metadata = std::vector<std::pair<std::string, std::string>>;  // keyword (1 to 79 Latin letters), text (UTF-8)

/// Throws std::invalid_argument for an empty image or keyword, std::runtime_error if the file cannot be written.
void write_png(const std::filesystem::path& path, const Image& image, const Metadata& metadata = {});

}  // namespace penalty::render
