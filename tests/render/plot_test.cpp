#include "render/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

namespace penalty::render {
namespace {

int occurrences(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

Plot energies() {
  return {.title = "Energy of <one> & all",
          .x_label = "t [s]",
          .y_label = "E [J]",
          .series = {{"elastic", {1, 0, 0}, {0, 1, 2}, {0, 4, 1}}, {"kinetic", {0, 0, 1}, {0, 1, 2}, {5, 1, 4}}}};
}

TEST(Plot, HasOneCurveASeriesAxesAndLegend) {
  const std::string text = svg(energies());
  EXPECT_EQ(text.rfind("<svg ", 0), 0u);
  EXPECT_EQ(occurrences(text, "</svg>"), 1);
  EXPECT_EQ(occurrences(text, "<polyline"), 2);
  EXPECT_EQ(occurrences(text, "stroke=\"#ff0000\""), 1);
  EXPECT_EQ(occurrences(text, "stroke=\"#0000ff\""), 1);
  for (const char* part :
       {">elastic<", ">kinetic<", ">t [s]<", ">E [J]<", "Energy of &lt;one&gt; &amp; all", ">0<", ">5<"})
    EXPECT_GE(occurrences(text, part), 1) << part;
  EXPECT_EQ(occurrences(text, "nan"), 0);
}

TEST(Plot, CurveRunsFromCornerToCorner) {
  const std::string text = svg({.series = {{"", {0, 0, 0}, {0, 10}, {0, 5}}}, .width = 640, .height = 400});
  // The plot area is 70..620 by 36..348.
  EXPECT_EQ(occurrences(text, "points=\"70.00,348.00 620.00,36.00\""), 1) << text;
}

TEST(Plot, NonFinitePointsInterrupt) {
  Plot plot = energies();
  plot.series[0] = {"elastic", {1, 0, 0}, {0, 1, 2, 3, 4}, {0, 1, std::nan(""), 1, 2}};
  const std::string text = svg(plot);
  EXPECT_EQ(occurrences(text, "stroke=\"#ff0000\""), 2);
  EXPECT_EQ(occurrences(text, "nan"), 0);
}

TEST(Plot, ConstantCurveHasAnAxis) {
  EXPECT_EQ(occurrences(svg({.series = {{"", {0, 0, 0}, {0, 1}, {3, 3}}}}), "<polyline"), 1);
}

TEST(Plot, ErrorsAreNamed) {
  EXPECT_THROW(svg({}), std::invalid_argument);
  EXPECT_THROW(svg({.series = {{"a", {0, 0, 0}, {0, 1}, {0}}}}), std::invalid_argument);
  EXPECT_THROW(write_svg("/nowhere/plot.svg", energies()), std::runtime_error);
}

TEST(Plot, FileHoldsTheText) {
  const auto path = std::filesystem::temp_directory_path() / "penalty_plot_test.svg";
  write_svg(path, energies());
  std::ifstream file(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), svg(energies()));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace penalty::render
