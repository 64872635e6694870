#include "render/image.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstdio>
#include <map>
#include <stdexcept>

namespace penalty::render {
namespace {

struct Decoded {
  Image image;
  std::map<std::string, std::string> texts;
  bool srgb = false;
};

/// libpng's own reader is the oracle.
Decoded decode(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) throw std::runtime_error("no file " + path.string());
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  Decoded result;
  result.image =
      Image(static_cast<int>(png_get_image_width(png, info)), static_cast<int>(png_get_image_height(png, info)));
  EXPECT_EQ(png_get_color_type(png, info), PNG_COLOR_TYPE_RGB);
  EXPECT_EQ(png_get_bit_depth(png, info), 8);
  const std::size_t row = 3 * static_cast<std::size_t>(result.image.width);
  for (int y = 0; y < result.image.height; ++y)
    std::copy_n(png_get_rows(png, info)[y], row, &result.image.rgb[row * y]);
  int intent = 0, count = 0;
  result.srgb = png_get_sRGB(png, info, &intent) != 0;
  png_textp texts = nullptr;
  png_get_text(png, info, &texts, &count);
  for (int i = 0; i < count; ++i) result.texts[texts[i].key] = texts[i].text;
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
  return result;
}

class ImageFile : public testing::Test {
 protected:
  ~ImageFile() override { std::filesystem::remove(path); }
  std::filesystem::path path =
      std::filesystem::temp_directory_path() /
      (std::string("penalty_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".png");
};

TEST_F(ImageFile, PixelsAndMetadataSurvive) {
  Image image(17, 5);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<std::uint8_t>(37 * i + i * i / 7);
  write_png(path, image, {{"Title", "Ball"}, {"Parameters", "E = 130 kPa, ν = 0.42"}, {"Seed", "7"}});
  const Decoded decoded = decode(path);
  EXPECT_EQ(decoded.image.width, 17);
  EXPECT_EQ(decoded.image.height, 5);
  EXPECT_EQ(decoded.image.rgb, image.rgb);
  EXPECT_TRUE(decoded.srgb);
  const std::map<std::string, std::string> expected{
      {"Title", "Ball"}, {"Parameters", "E = 130 kPa, ν = 0.42"}, {"Seed", "7"}};
  EXPECT_EQ(decoded.texts, expected);
}

TEST_F(ImageFile, WhatIsWrongIsThrown) {
  EXPECT_THROW(Image(0, 5), std::invalid_argument);
  EXPECT_THROW(Image(5, -1), std::invalid_argument);
  EXPECT_THROW(write_png(path, Image()), std::invalid_argument);
  Image torn(4, 4);
  torn.rgb.pop_back();
  EXPECT_THROW(write_png(path, torn), std::invalid_argument);
  EXPECT_THROW(write_png(path, Image(2, 2), {{"", "text"}}), std::invalid_argument);
  EXPECT_THROW(write_png("/nowhere/image.png", Image(2, 2)), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(path)) << "bad input leaves no file";
}

TEST_F(ImageFile, FullDiskIsNoticed) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  Image image(300, 300);
  EXPECT_THROW(write_png("/dev/full", image), std::runtime_error);
}

TEST(Image, PixelsAreCountedFromTheTopLeft) {
  Image image(3, 2);
  image.rgb[3 * (1 * 3 + 2) + 1] = 200;
  EXPECT_EQ(image.pixel(2, 1), (std::array<int, 3>{0, 200, 0}));
  EXPECT_EQ(image.pixel(0, 0), (std::array<int, 3>{0, 0, 0}));
}

}  // namespace
}  // namespace penalty::render
