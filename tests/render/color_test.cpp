#include "render/color.h"

#include <gtest/gtest.h>

#include <cmath>

namespace penalty::render {
namespace {

TEST(Color, MapsAreContinuousAndDistinctAtTheirEnds) {
  for (const ColorMap map : {ColorMap::turbo, ColorMap::viridis, ColorMap::diverging}) {
    for (int i = 1; i <= 1000; ++i) {
      const Color color = map_color(map, i / 1000.0), before = map_color(map, (i - 1) / 1000.0);
      ASSERT_GE(color.minCoeff(), 0);
      ASSERT_LE(color.maxCoeff(), 1);
      ASSERT_LT((color - before).cwiseAbs().maxCoeff(), 0.02) << i;
    }
    EXPECT_GT((map_color(map, 0) - map_color(map, 1)).norm(), 0.5);
    EXPECT_EQ(map_color(map, -3), map_color(map, 0));
    EXPECT_EQ(map_color(map, 7), map_color(map, 1));
    EXPECT_EQ(map_color(map, std::nan("")), map_color(map, 0));
  }
}

TEST(Color, NoMapBeginsInBlack) {
  for (const ColorMap map : {ColorMap::turbo, ColorMap::viridis, ColorMap::diverging})
    EXPECT_GT(map_color(map, 0).maxCoeff(), 0.3);
}

TEST(Color, DivergingIsGreyInTheMiddle) {
  const Color middle = map_color(ColorMap::diverging, 0.5);
  EXPECT_NEAR(middle[0], middle[1], 1e-6);
  EXPECT_NEAR(middle[1], middle[2], 1e-6);
  EXPECT_GT(map_color(ColorMap::diverging, 0)[2], map_color(ColorMap::diverging, 0)[0]);
  EXPECT_GT(map_color(ColorMap::diverging, 1)[0], map_color(ColorMap::diverging, 1)[2]);
}

TEST(Color, ScalePlacesValues) {
  const ColorScale linear_scale{.low = -2, .high = 6};
  EXPECT_DOUBLE_EQ(linear_scale.position(-2), 0);
  EXPECT_DOUBLE_EQ(linear_scale.position(0), 0.25);
  EXPECT_DOUBLE_EQ(linear_scale.position(100), 1);
  EXPECT_DOUBLE_EQ(linear_scale.position(std::nan("")), 0);
  const ColorScale root{.low = 0, .high = 100, .square_root = true};
  EXPECT_DOUBLE_EQ(root.position(1), 0.1);
  EXPECT_DOUBLE_EQ(root.position(25), 0.5);
  const ColorScale both{.low = -4, .high = 4, .square_root = true};
  EXPECT_DOUBLE_EQ(both.position(0), 0.5);
  EXPECT_DOUBLE_EQ(both.position(-1), 0.25);
  EXPECT_DOUBLE_EQ(ColorScale({.low = 3, .high = 3}).position(3), 0) << "an empty range is no error in a picture";
}

TEST(Color, PaletteTakesAnyIndex) {
  EXPECT_NE(palette(0), palette(1));
  EXPECT_EQ(palette(-8), palette(0));
  EXPECT_EQ(palette(8), palette(0));
}

}  // namespace
}  // namespace penalty::render
