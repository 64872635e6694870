#include "render/ticks.h"

#include <gtest/gtest.h>

#include <cmath>

namespace penalty::render {
namespace {

using Values = std::vector<double>;

TEST(Ticks, NiceStepsAreOneTwoFive) {
  EXPECT_DOUBLE_EQ(nice_step(1), 1);
  EXPECT_DOUBLE_EQ(nice_step(1.1), 2);
  EXPECT_DOUBLE_EQ(nice_step(3e-4), 5e-4);
  EXPECT_DOUBLE_EQ(nice_step(700), 1000);
  EXPECT_THROW(nice_step(0), std::invalid_argument);
}

TEST(Ticks, LinearTicksAreMultiplesInsideTheRange) {
  EXPECT_EQ(linear_ticks(0, 10, 6), (Values{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(linear_ticks(-1, 1, 5), (Values{-1, -0.5, 0, 0.5, 1}));
  const Values fine = linear_ticks(0.13, 0.17, 5);
  ASSERT_EQ(fine.size(), 5u);
  EXPECT_NEAR(fine.front(), 0.13, 1e-12);
  EXPECT_NEAR(fine.back(), 0.17, 1e-12);
  for (const auto& [low, high] : {std::pair{0.0, 1e-9}, {-3e7, 5e8}, {99.7, 100.1}, {-0.37, 0.91}})
    for (const int most : {2, 5, 9}) {
      const Values ticks = linear_ticks(low, high, most);
      EXPECT_GE(ticks.size(), 1u) << low << " to " << high;
      EXPECT_LE(static_cast<int>(ticks.size()), most);
      for (const double tick : ticks)
        EXPECT_TRUE(tick >= low - 1e-9 * (high - low) && tick <= high + 1e-9 * (high - low));
    }
  EXPECT_THROW(linear_ticks(1, 1, 5), std::invalid_argument);
  EXPECT_THROW(linear_ticks(0, std::nan(""), 5), std::invalid_argument);
  EXPECT_THROW(linear_ticks(0, 1, 1), std::invalid_argument);
}

TEST(Ticks, ScaleTicksKeepTheirDistance) {
  const auto root = [](double v) { return std::sqrt(v / 10); };
  const Values ticks = scale_ticks(0, 10, 0.08, false, root);
  EXPECT_EQ(ticks, (Values{0, 0.1, 0.5, 1, 2, 5, 10}));
  for (std::size_t i = 1; i < ticks.size(); ++i) EXPECT_GE(root(ticks[i]) - root(ticks[i - 1]), 0.08);
  const auto straight = [](double v) { return (v + 1) / 2; };
  EXPECT_EQ(scale_ticks(-1, 1, 0.1, true, straight), (Values{-1, -0.5, 0, 0.5, 1}));
  EXPECT_THROW(scale_ticks(2, 1, 0.1, false, straight), std::invalid_argument);
}

TEST(Ticks, LabelsAreShort) {
  EXPECT_EQ(tick_label(0), "0");
  EXPECT_EQ(tick_label(-0.0), "0");
  EXPECT_EQ(tick_label(0.05), "0.05");
  EXPECT_EQ(tick_label(2500), "2500");
  EXPECT_EQ(tick_label(0.30000000000000004), "0.3");
  EXPECT_EQ(tick_label(1e-7), "1e-7");
  EXPECT_EQ(tick_label(2e10), "2e10");
  EXPECT_EQ(tick_label(-5), "-5");
}

}  // namespace
}  // namespace penalty::render
