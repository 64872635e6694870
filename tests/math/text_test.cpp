#include "penalty/math/text.h"

#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

#include "random.h"

namespace penalty::testing {
namespace {

TEST(NumberText, ForPeopleHasSixDigitsAtMost) {
  EXPECT_EQ(to_text(1.0 / 6), "0.166667");
  EXPECT_EQ(to_text(3), "3");
  EXPECT_EQ(to_text(-0.1), "-0.1");
  EXPECT_EQ(to_text(123456789), "1.23457e+08");
  EXPECT_EQ(to_text(1e-300), "1e-300");
  EXPECT_EQ(to_text(std::nan("")), "nan");
  EXPECT_EQ(to_text(-std::numeric_limits<Real>::infinity()), "-inf");
}

TEST(NumberText, ExactTextIsShortAndReadsBackAsTheSameDouble) {
  EXPECT_EQ(exact_text(0.1), "0.1");
  EXPECT_EQ(exact_text(1.0 / 6), "0.16666666666666666");
  EXPECT_EQ(exact_text(-1e300), "-1e+300");
  constexpr unsigned seed = 11;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  int finite = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    const auto value = std::bit_cast<Real>(bits);
    if (!std::isfinite(value)) continue;
    ++finite;
    const std::string text = exact_text(value);
    Real back = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), back);
    ASSERT_TRUE(error == std::errc() && end == text.data() + text.size()) << text;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(back), bits) << text;
  }
  EXPECT_GT(finite, 19000);
}

}  // namespace
}  // namespace penalty::testing
