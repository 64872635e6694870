#include "render/image.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <memory>
#include <stdexcept>

namespace penalty::render {
namespace {

std::size_t bytes(int width, int height) {
  if (width <= 0 || height <= 0)
    throw std::invalid_argument("an image of " + std::to_string(width) + " x " + std::to_string(height) +
                                " pixels: both sizes must be positive");
  return 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// libpng reports errors by longjmp, which runs no destructors: everything that has one lives in the caller.
bool encode(png_structp png, png_infop info, std::FILE* file, const Image& image, std::vector<png_text>& texts) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_init_io(png, file);
  // Level 3 with all filters is half as long as level 6 and a few per cent larger.
  png_set_compression_level(png, 3);
  png_set_filter(png, 0, PNG_ALL_FILTERS);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  if (!texts.empty()) png_set_text(png, info, texts.data(), static_cast<int>(texts.size()));
  png_write_info(png, info);
  for (int y = 0; y < image.height; ++y)
    png_write_row(png, &image.rgb[3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width)]);
  png_write_end(png, info);
  return true;
}

}  // namespace

Image::Image(int w, int h) : width(w), height(h), rgb(bytes(w, h)) {}

void write_png(const std::filesystem::path& path, const Image& image, const Metadata& metadata) {
  if (image.rgb.size() != bytes(image.width, image.height))
    throw std::invalid_argument("write_png: the image does not hold width x height pixels");
  std::vector<png_text> texts(metadata.size());
  for (std::size_t i = 0; i < metadata.size(); ++i) {
    const auto& [keyword, text] = metadata[i];
    if (keyword.empty() || keyword.size() > 79)
      throw std::invalid_argument("write_png: the metadata keyword '" + keyword + "' must have 1 to 79 letters");
    const bool ascii = std::all_of(text.begin(), text.end(), [](unsigned char c) { return c < 128; });
    texts[i].compression = ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE;
    texts[i].key = const_cast<char*>(keyword.c_str());
    texts[i].text = const_cast<char*>(text.c_str());
    texts[i].text_length = ascii ? text.size() : 0;
    texts[i].itxt_length = ascii ? 0 : text.size();
  }

  const std::unique_ptr<std::FILE, FileCloser> file(std::fopen(path.c_str(), "wb"));
  if (!file) throw std::runtime_error("cannot write " + path.string());
  const auto quiet = [](png_structp, png_const_charp) {};
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, quiet);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  const bool written = info && encode(png, info, file.get(), image, texts) && std::fflush(file.get()) == 0;
  png_destroy_write_struct(&png, &info);
  if (!written) throw std::runtime_error("cannot write " + path.string() + " (disk full?)");
}

}  // namespace penalty::render
