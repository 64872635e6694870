#include "study/command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <thread>

#include "main/decimal.h"
#include "study/study_materials.h"

namespace penalty::study {
namespace {

using demo::UsageError;

constexpr long long most_jobs = 4096, most_shards = 100000, most_seeds = 1000000;
constexpr Real longest_time = 3600;  // simulated [s]

template <class List>
void append_list(std::string& text, const std::string& title, const List& list) {
  text += title + "\n";
  std::size_t width = 0;
  for (const auto& entry : list) width = std::max(width, entry.name.size());
  for (const auto& entry : list)
    text += "  " + std::string(entry.name) + std::string(width + 2 - entry.name.size(), ' ') +
            std::string(entry.description) + "\n";
}

int whole(long long value, const std::string& option, long long least, long long most) {
  if (value < least || value > most)
    throw UsageError(option + " is " + std::to_string(value) + ", must be " + std::to_string(least) + " to " +
                     std::to_string(most));
  return static_cast<int>(value);
}

void require_time(Real time) {
  if (!(time > 0 && time <= longest_time))
    throw UsageError("--time is " + std::to_string(time) + ", must be positive and at most " +
                     std::to_string(static_cast<int>(longest_time)) + " s");
}

/// "I/N" with 1 <= I <= N.
void read_shard(const std::string& text, RunCommand& run) {
  const char *begin = text.data(), *end = begin + text.size();
  const auto [slash, first_error] = std::from_chars(begin, end, run.shard);
  const bool has_slash = first_error == std::errc() && slash != end && *slash == '/';
  const auto [rest, error] = std::from_chars(has_slash ? slash + 1 : end, end, run.num_shards);
  if (!has_slash || error != std::errc() || rest != end || run.shard < 1 || run.num_shards < run.shard ||
      run.num_shards > most_shards)
    throw UsageError("--shard is \"" + text + "\", must be I/N with I from 1 to N, as in 2/4");
}

std::vector<std::filesystem::path> existing(const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (!std::filesystem::exists(name)) throw UsageError(name + ": no such file or directory");
  return {names.begin(), names.end()};
}

}  // namespace

CommandLine parse(int argc, const char* const* argv) {
  CLI::App app{"How often and how fast bodies recover from hard starts.", "penalty-study"};
  app.require_subcommand(1);
  CLI::App* list = app.add_subcommand("list", "Lists suites and materials");
  CLI::App* run = app.add_subcommand("run", "Runs what is missing of a suite");
  CLI::App* table = app.add_subcommand("table", "Prints what came of it");
  CLI::App* plot = app.add_subcommand("plot", "Draws recovery rates");
  CLI::App* stability =
      app.add_subcommand("stability", "Measures the implicit step with stiff bodies; status 1 if it fails");

  RunCommand run_command;
  std::string shard = "1/1", out;
  long long jobs = std::max(1u, std::thread::hardware_concurrency()), seeds = 1;
  Real time = 0;
  run->add_option("--suite", run_command.suite, "One of the suites of `penalty-study list`")
      ->required()
      ->type_name("NAME");
  run->add_option("--out", out, "Directory of the results; what it holds is not run again")
      ->required()
      ->type_name("DIR");
  run->add_option("--jobs", jobs, "Cases at a time; else as many as there are cores")->type_name("N");
  run->add_option("--shard", shard, "The I-th of N parts of the suite")->type_name("I/N");
  run->add_option("--seeds", seeds, "Seeds of every random start, from 1 on; else as the suite says")->type_name("N");
  run->add_option("--mesh", run_command.mesh, "One more body: what penalty-demo takes")->type_name("FILE");
  run->add_option("--time", time, "Simulated time in a world [s]")->type_name("S");

  TableCommand table_command;
  std::vector<std::string> paths;
  table->add_option("results", paths, "Directories or files of results")->required()->type_name("DIR|FILE");
  table->add_flag("--times", table_command.times, "Also the CPU time until recovery");
  table->add_flag("--json", table_command.json, "As JSON");
  plot->add_option("results", paths, "Directories or files of results")->required()->type_name("DIR|FILE");
  plot->add_option("--out", out, "The picture")->required()->type_name("FILE.png");
  stability->add_option("--time", time, "Simulated time of every flight, chain and impact [s]; else 2, 10 and 4")
      ->type_name("S");
  demo::read_as_decimal(*run, {"--jobs", "--seeds", "--time"});
  demo::read_as_decimal(*stability, {"--time"});

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    for (const CLI::App* command : {list, run, table, plot, stability})
      if (command->parsed()) return command->help();
    return app.help();
  } catch (const CLI::ParseError& error) {
    throw UsageError(demo::one_line(error.what()));
  }

  if (list->parsed()) {
    std::string text;
    append_list(text, "suites", suites());
    append_list(text, "materials", study_materials());
    return text;
  }
  if (table->parsed()) {
    table_command.paths = existing(paths);
    return table_command;
  }
  if (plot->parsed()) {
    if (std::filesystem::path(out).extension() != ".png") throw UsageError("--out " + out + " does not end in .png");
    return PlotCommand{existing(paths), out};
  }
  if (stability->parsed()) {
    StabilityCommand command;
    if (stability->count("--time") > 0) {
      require_time(time);
      command.time = time;
    }
    return command;
  }

  try {
    const Suite& suite = find_suite(run_command.suite);
    const auto refuse = [&](const char* option) {
      throw UsageError(std::string(option) + " does not apply to suite " + run_command.suite);
    };
    if (run->count("--time") > 0 && !suite.takes_time) refuse("--time");
    if (run->count("--mesh") > 0 && !suite.takes_mesh) refuse("--mesh");
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  if (out.empty()) throw UsageError("--out is empty, must be a directory");
  run_command.out = out;
  run_command.jobs = whole(jobs, "--jobs", 1, most_jobs);
  read_shard(shard, run_command);
  if (run->count("--seeds") > 0) run_command.options.seeds = whole(seeds, "--seeds", 1, most_seeds);
  if (run->count("--time") > 0) {
    require_time(time);
    run_command.options.time = time;
  }
  return run_command;
}

}  // namespace penalty::study
