// Letters, rasterised once into one picture.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string_view>
#include <vector>

namespace penalty::render {

enum class Face { text, title };

/// Corners relative to the pen [pixels, y downwards] and in the atlas (0 to 1).
struct Glyph {
  float x0, y0, x1, y1;
  float s0, t0, s1, t1;
  float advance;
};

class FontAtlas {
 public:
  /// DejaVuSans.ttf at `text_pixels`, DejaVuSans-Bold.ttf at `title_pixels`, both heights of a line. Throws
  /// std::runtime_error naming the file and the Debian package if one is missing.
  FontAtlas(const std::filesystem::path& directory, float text_pixels, float title_pixels);

  /// A box for a sign that the atlas lacks.
  const Glyph& glyph(Face face, char32_t sign) const;

  int side() const { return side_; }
  const std::vector<std::uint8_t>& coverage() const { return coverage_; }  // side x side

 private:
  int side_ = 512;
  std::vector<std::uint8_t> coverage_;
  std::map<char32_t, Glyph> glyphs_[2];
};

/// Code points of UTF-8; U+FFFD for what is not.
std::u32string decoded(std::string_view utf8);

}  // namespace penalty::render
