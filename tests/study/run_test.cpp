// Whole runs: in one go, killed, shared out; the results are the same.
#include <fcntl.h>
#include <signal.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "study_program.h"

namespace penalty::test {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

std::vector<std::string> run_of(const std::string& suite, const fs::path& out, const std::string& more = "") {
  std::vector<std::string> arguments{"run", "--suite", suite, "--out", out.string()};
  for (const std::string& word : words(more)) arguments.push_back(word);
  return arguments;
}

std::string table_of(const fs::path& directory) { return output_of({"table", directory.string()}); }

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream text(contents(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

/// The id of every case in a file, and its hash.
std::map<std::string, std::string> hashes_in(const fs::path& file) {
  std::map<std::string, std::string> hashes;
  for (const std::string& line : lines_of(file)) {
    const Json result = Json::parse(line);
    EXPECT_TRUE(hashes.emplace(result["id"], result["positions_hash"]).second) << result["id"];
  }
  return hashes;
}

TEST(StudyRun, OfTheQuickSuiteHasEveryMethodAndRecoversStatically) {
  const TemporaryDirectory directory;
  output_of(run_of("quick", directory / "out", "--jobs 2"));
  std::map<std::string, int> methods;
  for (const std::string& line : lines_of(directory / "out" / "results-1-of-1.jsonl")) {
    const Json result = Json::parse(line);
    ++methods[result["method"]];
    EXPECT_EQ(result["positions_hash"].get<std::string>().size(), 16u);
    EXPECT_GT(result["cpu_seconds"], 0);
    EXPECT_EQ(result["recovered"], result["rest_error"].is_number() && result["rest_error"] < 1e-2);
    if (result["method"] != "static") {
      EXPECT_EQ(result["end"], "finite");
      continue;
    }
    EXPECT_GT(result["iterations"], 0);
    if (result["material"] != "recovering") continue;
    EXPECT_EQ(result["recovered"], true) << result["id"];
    EXPECT_EQ(result["inverted"], 0);
    EXPECT_LE(result["to_recover"], result["iterations"]);
    EXPECT_LE(result["cpu_seconds_to_recover"], result["cpu_seconds"]);
  }
  EXPECT_EQ(methods.size(), 3u);
  EXPECT_GE(methods["classic"], 6);
  EXPECT_EQ(methods["classic"], methods["deformable"]);
  // A second run has nothing left to do.
  const std::string again = output_of(run_of("quick", directory / "out"));
  EXPECT_NE(again.find(": 0 cases run"), std::string::npos) << again;
}

TEST(StudyRun, GivesTheSameBitsOnAnyNumberOfThreads) {
  const TemporaryDirectory directory;
  for (const char* jobs : {"1", "3"}) output_of(run_of("quick", directory / jobs, std::string("--jobs ") + jobs));
  EXPECT_EQ(hashes_in(directory / "1" / "results-1-of-1.jsonl"), hashes_in(directory / "3" / "results-1-of-1.jsonl"));
  EXPECT_EQ(table_of(directory / "1"), table_of(directory / "3"));
}

TEST(StudyRun, ThatIsKilledGoesOnWhereItWas) {
  const TemporaryDirectory directory;
  const std::string size = "--seeds 2 --jobs 1";
  const fs::path file = directory / "killed" / "results-1-of-1.jsonl";
  const std::vector<std::string> arguments = run_of("rates", directory / "killed", size);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int stream : {0, 1, 2}) dup2(nowhere, stream);
    std::vector<char*> argv{const_cast<char*>(PENALTY_STUDY)};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (lines_of(file).size() < 5 && waitpid(child, &status, WNOHANG) == 0 &&
         std::chrono::steady_clock::now() < give_up)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  kill(child, SIGKILL);
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "it was done before it could be killed";
  const std::size_t left = lines_of(file).size();
  EXPECT_GE(left, 5u);

  const std::string resumed = output_of(arguments);
  EXPECT_NE(resumed.find(", " + std::to_string(left) + " were there"), std::string::npos) << resumed;
  output_of(run_of("rates", directory / "one_go", size));
  EXPECT_EQ(table_of(directory / "killed"), table_of(directory / "one_go"));
  EXPECT_EQ(hashes_in(file), hashes_in(directory / "one_go" / "results-1-of-1.jsonl"));
}

TEST(StudyRun, RepairsALastLineThatWasCutOff) {
  const TemporaryDirectory directory;
  const fs::path file = directory / "out" / "results-1-of-1.jsonl";
  output_of(run_of("quick", directory / "out", "--jobs 1"));
  const std::string table = table_of(directory / "out"), whole = contents(file);
  for (const std::size_t missing : {std::size_t{1}, std::size_t{40}}) {
    fs::resize_file(file, whole.size() - missing);
    EXPECT_NE(table_of(directory / "out"), table) << "the last case is not there";
    const std::string resumed = output_of(run_of("quick", directory / "out"));
    EXPECT_NE(resumed.find(": 1 cases run"), std::string::npos) << resumed;
    EXPECT_EQ(table_of(directory / "out"), table);
  }
}

TEST(StudyRun, KnowsWhatOtherShardsHaveDone) {
  const TemporaryDirectory directory;
  std::map<std::string, std::string> together;
  for (const char* shard : {"1/3", "2/3", "3/3"})
    output_of(run_of("quick", directory / "parts", std::string("--shard ") + shard));
  for (const char* part : {"1", "2", "3"})
    for (const auto& entry : hashes_in(directory / "parts" / (std::string("results-") + part + "-of-3.jsonl")))
      EXPECT_TRUE(together.insert(entry).second) << entry.first;
  output_of(run_of("quick", directory / "one_go"));
  EXPECT_EQ(together, hashes_in(directory / "one_go" / "results-1-of-1.jsonl"));
  EXPECT_EQ(table_of(directory / "parts"), table_of(directory / "one_go"));
  const std::string again = output_of(run_of("quick", directory / "parts"));
  EXPECT_NE(again.find(": 0 cases run"), std::string::npos) << again;
}

TEST(StudyRun, TakesAMeshFromAFile) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "corner.vtk") << "# vtk DataFile Version 3.0\none tetrahedron\nASCII\n"
                                             "DATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\n"
                                             "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  output_of(run_of("rates", directory / "out", "--seeds 1 --mesh " + (directory / "corner.vtk").string()));
  const std::string table = table_of(directory / "out");
  EXPECT_NE(table.find("corner.vtk-"), std::string::npos) << table;
  EXPECT_NE(table.find(" (1) "), std::string::npos) << table;
}

TEST(StudyTable, RefusesResultsThatContradictEachOther) {
  const TemporaryDirectory directory;
  output_of(run_of("quick", directory / "out"));
  const fs::path file = directory / "out" / "results-1-of-1.jsonl", copy = directory / "out" / "results-2-of-2.jsonl";
  const std::string table = table_of(directory / "out");
  Json result = Json::parse(lines_of(file)[3]);
  result["cpu_seconds"] = 1e3;
  std::ofstream(copy) << result.dump() << "\n";
  EXPECT_EQ(table_of(directory / "out"), table) << "counted once";
  result["positions_hash"] = "0123456789abcdef";
  std::ofstream(copy) << result.dump() << "\n";
  expect_error(run_study({"table", (directory / "out").string()}), 1, result["id"]);
}

TEST(StudyTable, SaysTheSameAsJsonAndDrawsIt) {
  const TemporaryDirectory directory;
  output_of(run_of("quick", directory / "out"));
  const std::string out = (directory / "out").string();
  const Json rows = Json::parse(output_of({"table", out, "--json"}));
  std::size_t lines = 0;
  for (const char c : output_of({"table", out})) lines += c == '\n';
  EXPECT_EQ(rows.size(), lines - 2) << "a line with the name of the suite, and one with those of the columns";
  for (const Json& row : rows) {
    EXPECT_EQ(row["suite"], "quick");
    EXPECT_FALSE(row.contains("median_cpu_seconds_to_recover"));
    EXPECT_LE(row["rate_low"], row["rate"]);
    EXPECT_GE(row["rate_high"], row["rate"]);
  }
  EXPECT_EQ(unreadable_numbers(output_of({"table", out, "--times"})), std::vector<std::string>{});
  EXPECT_TRUE(Json::parse(output_of({"table", out, "--json", "--times"}))[0].contains("median_cpu_seconds_to_recover"));
  EXPECT_EQ(output_of({"plot", out, "--out", (directory / "rates.png").string()}), "");
  EXPECT_EQ(contents(directory / "rates.png").substr(1, 3), "PNG");
}

TEST(StudyStability, FindsNothingThatGrows) {
  const std::string table = output_of({"stability", "--time", "0.1"});
  EXPECT_NE(table.find("finite"), std::string::npos);
  EXPECT_EQ(table.find("NO"), std::string::npos);
  EXPECT_EQ(unreadable_numbers(table), std::vector<std::string>{}) << table;
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 2 + 11 * 3 + 1 + 2 + 5 + 1 + 2 + 10 * 3 * 2 + 1 + 2 + 5 * 3);
}

}  // namespace
}  // namespace penalty::test
