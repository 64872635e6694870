#include "study/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "study/fnv.h"
#include "study/recovery_watch.h"

namespace penalty::study {
namespace {

StudyResult result_of(std::uint32_t seed, Real error, Real to_recover) {
  StudyResult result;
  result.which = {.suite = "rates",
                  .method = "static",
                  .precision = "double",
                  .material = "recovering",
                  .mesh = "box4",
                  .start = "scramble",
                  .seed = seed};
  result.tetrahedra = 320;
  result.rest_error = error;
  if (result.recovered()) {
    result.to_recover = to_recover;
    result.cpu_seconds_to_recover = to_recover / 100;
  }
  return result;
}

TEST(WilsonInterval, AgreesWithItsClosedForm) {
  struct Known {
    int successes, runs;
    Real low, high;
  };
  for (const Known& known : {Known{0, 10, 0, 0.2775}, Known{10, 10, 0.7225, 1}, Known{5, 10, 0.2366, 0.7634}}) {
    const Interval interval = wilson_interval(known.successes, known.runs);
    EXPECT_NEAR(interval.low, known.low, 5e-5);
    EXPECT_NEAR(interval.high, known.high, 5e-5);
  }
  // Its ends solve |p - rate| = z sqrt(rate (1 - rate) / n).
  for (const int successes : {1, 3, 28, 29}) {
    const Interval interval = wilson_interval(successes, 30);
    for (const Real end : {interval.low, interval.high})
      EXPECT_NEAR(std::abs(successes / 30.0 - end), 1.959963984540054 * std::sqrt(end * (1 - end) / 30), 1e-14);
  }
}

TEST(Table, CountsAndTakesMedians) {
  const std::vector<TableRow> rows =
      table_rows({result_of(1, 1e-8, 10), result_of(2, 0.5, 0), result_of(3, 1e-3, 40), result_of(4, 1e-9, 12),
                  result_of(5, std::numeric_limits<Real>::quiet_NaN(), 0), result_of(6, 1e-9, 20)});
  ASSERT_EQ(rows.size(), 1u);
  const TableRow& row = rows.front();
  EXPECT_EQ(row.runs, 6);
  EXPECT_EQ(row.recovered, 4);
  EXPECT_EQ(row.median_to_recover, 16);
  EXPECT_EQ(row.largest_to_recover, 40);
  EXPECT_EQ(row.largest_error, 1e-3);
  EXPECT_EQ(row.median_cpu, 0.16);
  const std::string text = table_text(rows, false);
  for (const char* part : {"suite rates\n", "box4 (320)", "4/6", "66.7", "16 it", "40 it", "1.0e-03"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  EXPECT_EQ(text.find("CPU"), std::string::npos);
  EXPECT_NE(table_text(rows, true).find("0.16 s"), std::string::npos);
}

TEST(Table, DoesNotDependOnTheOrderOfResults) {
  std::vector<StudyResult> results;
  for (const char* mesh : {"box4", "kuhn2"})
    for (const char* material : {"springs", "recovering", "unheard-of"})
      for (std::uint32_t seed = 1; seed <= 3; ++seed) {
        results.push_back(result_of(seed, 1e-4 * seed, seed));
        results.back().which.mesh = mesh;
        results.back().which.material = material;
        results.back().tetrahedra = mesh[0] == 'b' ? 320 : 48;
      }
  const std::string text = table_text(table_rows(results), true);
  std::reverse(results.begin(), results.end());
  EXPECT_EQ(table_text(table_rows(results), true), text);
  EXPECT_LT(text.find("recovering"), text.find("springs"));
  EXPECT_LT(text.find("springs"), text.find("unheard-of"));
  EXPECT_LT(text.find("kuhn2"), text.find("box4"));
}

TEST(Table, OfNothingIsEmpty) {
  EXPECT_EQ(table_text(table_rows({}), true), "");
  EXPECT_EQ(table_json(table_rows({}), false).dump(), "[]");
}

TEST(RecoveryWatch, ForgetsARecoveryThatDidNotLast) {
  RecoveryWatch watch;
  EXPECT_FALSE(watch.since());
  watch.see(0.5, {1, 0.1});
  watch.see(0.001, {2, 0.2});
  watch.see(0.02, {3, 0.3});
  EXPECT_FALSE(watch.since());
  watch.see(0.009, {4, 0.4});
  watch.see(0.001, {5, 0.5});
  ASSERT_TRUE(watch.since());
  const auto since = watch.since().value_or(RecoveryWatch::Moment{});
  EXPECT_EQ(since.progress, 4);
  EXPECT_EQ(since.cpu_seconds, 0.4);
  watch.see(std::numeric_limits<Real>::quiet_NaN(), {6, 0.6});
  EXPECT_FALSE(watch.since());
}

TEST(Fnv, AgreesWithPublishedValues) {
  EXPECT_EQ(Fnv().hex(), "cbf29ce484222325");
  Fnv a, foobar;
  a.add("a", 1);
  foobar.add("foo", 3);
  foobar.add("bar", 3);
  EXPECT_EQ(a.hex(), "af63dc4c8601ec8c");
  EXPECT_EQ(foobar.hex(), "85944171f73967e8");
}

}  // namespace
}  // namespace penalty::study
