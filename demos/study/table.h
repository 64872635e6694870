// Results in groups: what a study says.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "study/study_result.h"
#include "study/wilson.h"

namespace penalty::study {

/// The cases that differ by their seeds alone.
struct TableRow {
  StudyCase which;  // of the first of them
  int tetrahedra = 0, runs = 0, recovered = 0;
  Interval rate{0, 1};  // 95 %
  // Of the recovered; empty if none is.
  std::optional<Real> median_to_recover = {}, largest_to_recover = {};  // iterations, or simulated time [s]
  std::optional<Real> largest_error = {};
  std::optional<Real> median_cpu = {}, largest_cpu = {};  // to recover [s]
};

/// In an order that the order of `results` does not change. Each case is there once, see `merged`.
std::vector<TableRow> table_rows(const std::vector<StudyResult>& results);

/// A table for each suite. Without `times` it has nothing that differs between two runs of the same program.
std::string table_text(const std::vector<TableRow>& rows, bool times);
nlohmann::ordered_json table_json(const std::vector<TableRow>& rows, bool times);

}  // namespace penalty::study
