// The command line of penalty-study, checked.
#pragma once
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "main/usage_error.h"
#include "study/suites.h"

namespace penalty::study {

struct RunCommand {
  std::string suite;
  std::filesystem::path out;
  int jobs = 1, shard = 1, num_shards = 1;
  std::string mesh;  // a file; empty: none
  SuiteOptions options;
};

struct TableCommand {
  std::vector<std::filesystem::path> paths;
  bool times = false, json = false;
};

struct PlotCommand {
  std::vector<std::filesystem::path> paths;
  std::filesystem::path out;
};

struct StabilityCommand {
  std::optional<Real> time;  // simulated, of every flight and chain [s]
};

/// A text to be printed on standard output, or something to do.
using CommandLine = std::variant<std::string, RunCommand, TableCommand, PlotCommand, StabilityCommand>;

/// Throws demo::UsageError.
CommandLine parse(int argc, const char* const* argv);

}  // namespace penalty::study
