// Which cases belong together.
#pragma once
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "study/study_case.h"

namespace penalty::study {

struct SuiteOptions {
  std::optional<int> seeds = {};  // of every random start; empty: as the suite says
  std::optional<Real> time = {};  // simulated [s]
  std::string file_mesh = {};     // name of the user's own mesh, see StudyMeshes; empty: none
};

struct Suite {
  std::string_view name, description;
  bool takes_mesh, takes_time;  // of SuiteOptions
  std::vector<StudyCase> (*cases)(const SuiteOptions& options);
};

std::span<const Suite> suites();

/// Throws std::invalid_argument that names the choices.
const Suite& find_suite(std::string_view name);

/// Shard `shard` of `count`, counted from 1: every count-th case. Of all shards together each case is in exactly one.
std::vector<StudyCase> shard_of(const std::vector<StudyCase>& cases, int shard, int count);

/// Whether the seed decides anything about a start of this name.
bool is_random(std::string_view start);

}  // namespace penalty::study
