// What a user can get wrong ends with one line that says it.
#include "study_program.h"

namespace penalty::test {
namespace {

struct Misuse {
  const char *arguments, *mentions;
};

TEST(StudyCommandLine, RefusesWhatItDoesNotKnow) {
  for (const Misuse& misuse :
       {Misuse{"", "subcommand"}, Misuse{"bogus", "subcommand"}, Misuse{"run --out x", "--suite"},
        Misuse{"run --suite quick", "--out"}, Misuse{"table", "results"}, Misuse{"table nowhere", "nowhere"},
        Misuse{"plot nowhere --out x.png", "nowhere"}, Misuse{"plot . --out x.svg", ".png"},
        Misuse{"stability --time 0", "--time"}, Misuse{"stability --time nan", "--time"}}) {
    SCOPED_TRACE(misuse.arguments);
    expect_error(run_study(words(misuse.arguments)), 2, misuse.mentions);
  }
}

TEST(StudyCommandLine, RefusesImpossibleRuns) {
  const TemporaryDirectory directory;
  for (const Misuse& misuse :
       {Misuse{"--suite slow", "static, rates, world, speed, quick"}, Misuse{"--suite quick --jobs 0", "--jobs"},
        Misuse{"--suite quick --jobs many", "many"}, Misuse{"--suite quick --jobs 0x1", "0x1"},
        Misuse{"--suite quick --shard 0/4", "0/4"}, Misuse{"--suite quick --shard 5/4", "5/4"},
        Misuse{"--suite quick --shard 1", "I/N"}, Misuse{"--suite quick --shard 1/2/3", "I/N"},
        Misuse{"--suite quick --shard a/b", "I/N"}, Misuse{"--suite quick --seeds 0", "--seeds"},
        Misuse{"--suite quick --time -1", "--time"}, Misuse{"--suite static --time 3", "does not apply"},
        Misuse{"--suite quick --mesh ball", "does not apply"},
        Misuse{"--suite world --mesh dragon.vtk", "dragon.vtk"}}) {
    SCOPED_TRACE(misuse.arguments);
    std::vector<std::string> arguments = words("run " + std::string(misuse.arguments));
    arguments.insert(arguments.end(), {"--out", (directory / "out").string()});
    expect_error(run_study(arguments), 2, misuse.mentions);
    EXPECT_FALSE(std::filesystem::exists(directory / "out")) << "nothing was begun";
  }
}

TEST(StudyCommandLine, SaysWhatFilesCannotBeUsed) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "file") << "no directory\n";
  expect_error(run_study({"run", "--suite", "quick", "--out", (directory / "file").string()}), 2,
               "results-1-of-1.jsonl");
  std::ofstream(directory / "results-1-of-1.jsonl") << "{}\n";
  expect_error(run_study({"table", directory.path().string()}), 2, "results-1-of-1.jsonl:1: ");
  std::ofstream(directory / "results-1-of-1.jsonl") << "";
  expect_error(run_study({"plot", directory.path().string(), "--out", (directory / "x.png").string()}), 2,
               "no results");
}

TEST(StudyCommandLine, ListsAndHelps) {
  const std::string list = output_of({"list"});
  for (const char* name : {"static", "rates", "world", "speed", "quick", "recovering", "springs+volumes"})
    EXPECT_NE(list.find(std::string("  ") + name + " "), std::string::npos) << name;
  EXPECT_NE(output_of({"--help"}).find("stability"), std::string::npos);
  EXPECT_NE(output_of({"run", "--help"}).find("--shard"), std::string::npos);
}

}  // namespace
}  // namespace penalty::test
