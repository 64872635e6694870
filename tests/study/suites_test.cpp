#include "study/suites.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "scenes/scene_options.h"

namespace penalty::study {
namespace {

TEST(Suites, HaveEachCaseOnce) {
  for (const Suite& suite : suites()) {
    std::set<std::string> ids;
    const std::vector<StudyCase> cases = suite.cases({.file_mesh = "user"});
    for (const StudyCase& c : cases) {
      EXPECT_EQ(c.suite, suite.name);
      EXPECT_EQ(c.is_static(), c.duration == 0);
      EXPECT_TRUE(ids.insert(c.id()).second) << c.id();
    }
    EXPECT_EQ(ids.size(), cases.size());
  }
}

TEST(Suites, HaveEveryStartButRest) {
  std::set<std::string> starts;
  for (const StudyCase& c : find_suite("static").cases({})) starts.insert(c.start);
  for (const demo::Start start : demo::all_starts()) {
    const std::string name(demo::name_of(start));
    EXPECT_EQ(starts.contains(name), start != demo::Start::rest) << name;
  }
}

TEST(Suites, DrawOnlyRandomStartsAgain) {
  EXPECT_TRUE(is_random("scramble"));
  for (const char* exact : {"squash", "plane", "line", "point", "mirror"}) {
    EXPECT_FALSE(is_random(exact));
    int runs = 0;
    for (const StudyCase& c : find_suite("static").cases({.seeds = 7})) runs += c.start == exact && c.mesh == "box4";
    EXPECT_EQ(runs, 1) << exact;
  }
  std::set<std::uint32_t> seeds;
  for (const StudyCase& c : find_suite("static").cases({.seeds = 7}))
    if (c.start == "scramble" && c.mesh == "box4") seeds.insert(c.seed);
  EXPECT_EQ(seeds.size(), 7u);
}

TEST(Suites, KeepRunsOfOtherDurationsApart) {
  const auto short_runs = find_suite("world").cases({}), long_runs = find_suite("world").cases({.time = 20});
  ASSERT_EQ(short_runs.size(), long_runs.size());
  EXPECT_EQ(short_runs.front().duration, 5);
  EXPECT_NE(short_runs.front().id(), long_runs.front().id());
}

TEST(Shards, AreCompleteAndDisjoint) {
  const std::vector<StudyCase> cases = find_suite("quick").cases({});
  for (const int count : {1, 2, 3, 7, 1000}) {
    std::set<std::string> ids;
    std::size_t most = 0, least = cases.size();
    for (int shard = 1; shard <= count; ++shard) {
      const std::vector<StudyCase> part = shard_of(cases, shard, count);
      for (const StudyCase& c : part) EXPECT_TRUE(ids.insert(c.id()).second) << c.id();
      most = std::max(most, part.size());
      least = std::min(least, part.size());
    }
    EXPECT_EQ(ids.size(), cases.size()) << count << " shards";
    EXPECT_LE(most - least, 1u);
  }
}

TEST(Suites, OfAnUnknownNameAreNamed) {
  try {
    find_suite("slow");
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "unknown suite \"slow\", must be one of static, rates, world, speed, quick");
  }
}

}  // namespace
}  // namespace penalty::study
