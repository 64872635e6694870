#include "study/results_directory.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>

#include "demos/program.h"

namespace penalty::study {
namespace {

using test::contents;
using test::TemporaryDirectory;

StudyResult result_of(std::uint32_t seed) {
  StudyResult result;
  result.which = {.suite = "world",
                  .method = "classic",
                  .precision = "float32",
                  .material = "recovering",
                  .mesh = "box4",
                  .start = "scramble",
                  .seed = seed,
                  .duration = 20};
  result.vertices = 125;
  result.tetrahedra = 320;
  result.rest_error = 1.0 / 3 * seed;
  result.rest_error_at_5s = 0.7;
  result.inverted = 4;
  result.iterations = 1200;
  result.end = "finite";
  result.positions_hash = "0123456789abcdef";
  result.cpu_seconds = 0.1;
  return result;
}

std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(StudyResult, ComesBackFromItsLine) {
  StudyResult result = result_of(3);
  for (const Real error : {result.rest_error, 1e-9, std::numeric_limits<Real>::quiet_NaN()}) {
    result.rest_error = error;
    result.to_recover = error < 1 ? std::optional<Real>(17) : std::nullopt;
    const std::string line = to_line(result);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const StudyResult back = from_line(line);
    EXPECT_EQ(back.which, result.which);
    EXPECT_EQ(to_line(back), line);
    EXPECT_TRUE(back.agrees_with(result));
  }
}

TEST(ResultFile, KeepsWhatIsThereAndTakesOffHalfALine) {
  const TemporaryDirectory directory;
  const auto path = directory / "results-2-of-3.jsonl";
  {
    ResultFile(directory.path(), 2, 3).append(result_of(1));
  }
  const std::string one = contents(path);
  EXPECT_EQ(one, to_line(result_of(1)) + "\n");
  std::ofstream(path, std::ios::app) << to_line(result_of(2)).substr(0, 50);
  EXPECT_EQ(read_results({directory.path()}).size(), 1u) << "a half line is no result yet";
  {
    ResultFile(directory.path(), 2, 3).append(result_of(3));
  }
  EXPECT_EQ(contents(path), one + to_line(result_of(3)) + "\n");
  EXPECT_EQ(read_results({directory.path()}).size(), 2u);
}

TEST(ResultFile, HasOneWriter) {
  const TemporaryDirectory directory;
  const ResultFile first(directory.path(), 1, 1);
  const ResultFile other_shard(directory.path(), 1, 2);
  const std::string message = message_of([&] { ResultFile second(directory.path(), 1, 1); });
  EXPECT_TRUE(message.ends_with("results-1-of-1.jsonl: another run is writing it")) << message;
}

TEST(ReadResults, NamesTheLineThatIsNone) {
  const TemporaryDirectory directory;
  const auto path = directory / "some.jsonl";
  std::ofstream(path) << to_line(result_of(1)) << "\n{\"id\": 3}\n" << to_line(result_of(2)) << "\n";
  const std::string message = message_of([&] { read_results({path}); });
  EXPECT_TRUE(message.starts_with(path.string() + ":2: no result of a study: ")) << message;
  EXPECT_TRUE(read_results({directory.path()}).empty()) << "of a directory only files of results are read";
  EXPECT_NE(message_of([&] { read_results({directory / "nowhere"}); }).find("cannot be read"), std::string::npos);
}

TEST(Merged, HasEachCaseOnceAndRefusesContradictions) {
  StudyResult slower = result_of(1);
  slower.cpu_seconds = 9;
  slower.cpu_seconds_to_recover = 8;
  EXPECT_EQ(merged({result_of(1), result_of(2), slower}).size(), 2u);
  slower.positions_hash.back() = '0';
  EXPECT_EQ(message_of([&] { merged({result_of(1), result_of(2), slower}); }),
            "two results of world/classic float32 20 s/recovering/box4/scramble/1 contradict each other");
}

}  // namespace
}  // namespace penalty::study
