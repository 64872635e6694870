#include "render/rasterize.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "render/renderer.h"

namespace penalty::render {
namespace {

constexpr int width = 1280, height = 720;  // a unit of the canvas is a pixel

class Rasterize : public testing::Test {
 protected:
  Rasterize()
      : fonts(RendererOptions{}.font_directory, Canvas::text_size, Canvas::title_size), canvas(fonts, width, height) {
    std::fill(image.rgb.begin(), image.rgb.end(), std::uint8_t{255});
  }

  /// Sum over the picture of how much darker than white the first channel is, in pixels.
  double darkness() const {
    double sum = 0;
    for (std::size_t k = 0; k < image.rgb.size(); k += 3) sum += (255 - image.rgb[k]) / 255.0;
    return sum;
  }

  FontAtlas fonts;
  Canvas canvas;
  Image image{width, height};
};

TEST_F(Rasterize, FillsARectangleToThePixelAndOnce) {
  canvas.rectangle(10, 20, 30, 40, {0, 0, 1, 0.4f});
  rasterize(canvas, fonts, image);
  const std::array<int, 3> white{255, 255, 255}, blue{153, 153, 255};
  for (int y = 18; y < 63; ++y)
    for (int x = 8; x < 43; ++x)
      ASSERT_EQ(image.pixel(x, y), x >= 10 && x < 40 && y >= 20 && y < 60 ? blue : white) << x << ", " << y;
}

TEST_F(Rasterize, DrawsLinesOfTheirThickness) {
  canvas.line({100, 100}, {300, 250}, 3, {0, 0, 0, 1});
  rasterize(canvas, fonts, image);
  EXPECT_NEAR(darkness(), 250 * 3, 12);
  EXPECT_EQ(image.pixel(200, 175)[0], 0);
}

TEST_F(Rasterize, DrawsLettersAndStaysInside) {
  canvas.text(100, 100, "rate", {0, 0, 0, 1});
  canvas.rectangle(-50, -50, 60, 60, {0, 0, 0, 1});
  canvas.line({1270, 700}, {1400, 900}, 4, {0, 0, 0, 1});
  rasterize(canvas, fonts, image);
  EXPECT_EQ(image.pixel(0, 0)[0], 0);
  EXPECT_EQ(image.pixel(9, 9)[0], 0);
  EXPECT_EQ(image.pixel(10, 10)[0], 255);
  double ink = 0;
  for (int y = 80; y < 110; ++y)
    for (int x = 95; x < 150; ++x) ink += (255 - image.pixel(x, y)[0]) / 255.0;
  const double box = 16 * canvas.text_width("rate");
  EXPECT_GT(ink, 0.1 * box);
  EXPECT_LT(ink, 0.5 * box);
}

}  // namespace
}  // namespace penalty::render
