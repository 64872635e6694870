#include "render/font.h"

#include <array>
#include <fstream>
#include <iterator>
#include <stdexcept>

#define STBTT_STATIC
#define STB_TRUETYPE_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"  // the library is one header, of which we use a part
#include <stb/stb_truetype.h>
#pragma GCC diagnostic pop

namespace penalty::render {
namespace {

struct Range {
  int first, last;
};

// Latin, Greek, dashes and ellipsis, raised and lowered digits, arrows, mathematical signs, the box for the rest.
constexpr std::array<Range, 7> ranges{{{0x20, 0x7e},
                                       {0xa0, 0xff},
                                       {0x391, 0x3c9},
                                       {0x2010, 0x2026},
                                       {0x2070, 0x2094},
                                       {0x2190, 0x2193},
                                       {0x2202, 0x2265}}};
constexpr char32_t replacement = 0xfffd;

std::vector<unsigned char> read_font(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<unsigned char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (bytes.empty() || stbtt_GetFontOffsetForIndex(bytes.data(), 0) < 0)
    throw std::runtime_error("cannot read the font " + path.string() + " (Debian package fonts-dejavu-core)");
  return bytes;
}

}  // namespace

FontAtlas::FontAtlas(const std::filesystem::path& directory, float text_pixels, float title_pixels) {
  const std::array<std::vector<unsigned char>, 2> fonts{read_font(directory / "DejaVuSans.ttf"),
                                                        read_font(directory / "DejaVuSans-Bold.ttf")};
  const std::array<float, 2> heights{text_pixels, title_pixels};
  for (bool fits = false; !fits; side_ *= 2) {
    if (side_ > 8192) throw std::runtime_error("the letters do not fit into a texture: the picture is too large");
    coverage_.assign(static_cast<std::size_t>(side_) * side_, 0);
    stbtt_pack_context packer;
    if (!stbtt_PackBegin(&packer, coverage_.data(), side_, side_, 0, 2, nullptr)) continue;
    // Twice as fine across, for letters between pixels; not upwards, where lines are on whole pixels and stay crisp.
    stbtt_PackSetOversampling(&packer, 2, 1);
    fits = true;
    for (int face = 0; face < 2 && fits; ++face) {
      glyphs_[face].clear();
      std::vector<stbtt_pack_range> wanted;
      std::vector<std::vector<stbtt_packedchar>> packed;
      const auto add = [&](int first, int last) {
        packed.emplace_back(static_cast<std::size_t>(last - first + 1));
        stbtt_pack_range range{};
        range.font_size = heights[face];
        range.first_unicode_codepoint_in_range = first;
        range.num_chars = last - first + 1;
        wanted.push_back(range);
      };
      for (const Range& range : ranges) add(range.first, range.last);
      add(static_cast<int>(replacement), static_cast<int>(replacement));
      for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i].chardata_for_range = packed[i].data();
      fits = stbtt_PackFontRanges(&packer, fonts[face].data(), 0, wanted.data(), static_cast<int>(wanted.size()));
      for (std::size_t i = 0; i < wanted.size(); ++i)
        for (int k = 0; k < wanted[i].num_chars; ++k) {
          float x = 0, y = 0;
          stbtt_aligned_quad q;
          stbtt_GetPackedQuad(packed[i].data(), side_, side_, k, &x, &y, &q, 0);
          glyphs_[face][static_cast<char32_t>(wanted[i].first_unicode_codepoint_in_range + k)] = {
              q.x0, q.y0, q.x1, q.y1, q.s0, q.t0, q.s1, q.t1, x};
        }
    }
    stbtt_PackEnd(&packer);
    if (fits) break;
  }
}

const Glyph& FontAtlas::glyph(Face face, char32_t sign) const {
  const auto& glyphs = glyphs_[static_cast<int>(face)];
  const auto found = glyphs.find(sign);
  return found != glyphs.end() ? found->second : glyphs.at(replacement);
}

std::u32string decoded(std::string_view utf8) {
  std::u32string text;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i++]);
    const int more = lead < 0x80                   ? 0
                     : lead >= 0xc2 && lead < 0xe0 ? 1
                     : lead >= 0xe0 && lead < 0xf0 ? 2
                     : lead >= 0xf0 && lead < 0xf5 ? 3
                                                   : -1;
    char32_t sign = more <= 0 ? lead : lead & (0x3f >> more);
    bool valid = more >= 0;
    for (int k = 0; k < more && valid; ++k) {
      valid = i < utf8.size() && (static_cast<unsigned char>(utf8[i]) & 0xc0) == 0x80;
      if (valid) sign = (sign << 6) | (static_cast<unsigned char>(utf8[i++]) & 0x3f);
    }
    text += valid ? sign : replacement;
  }
  return text;
}

}  // namespace penalty::render
