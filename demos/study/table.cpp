#include "study/table.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "scenes/scene_options.h"
#include "study/study_materials.h"
#include "study/suites.h"

namespace penalty::study {
namespace {

/// Where `name` is in a list of what has a name; behind all if it is not.
template <class List, class Name>
std::size_t place_in(const List& named, const std::string& name, const Name& name_of) {
  const auto found =
      std::find_if(named.begin(), named.end(), [&](const auto& entry) { return name_of(entry) == name; });
  return static_cast<std::size_t>(found - named.begin());
}

/// What rows are told apart and sorted by: as the program lists things, small meshes first.
auto key_of(const StudyResult& result) {
  const StudyCase& c = result.which;
  const auto name = [](const auto& entry) { return entry.name; };
  const auto start_name = [](demo::Start start) { return demo::name_of(start); };
  return std::tuple(place_in(suites(), c.suite, name), c.suite, !c.is_static(), c.method, c.precision, c.duration,
                    place_in(study_materials(), c.material, name), c.material, result.tetrahedra, c.mesh,
                    place_in(demo::all_starts(), c.start, start_name), c.start);
}

std::optional<Real> largest(const std::vector<Real>& values) {
  if (values.empty()) return {};
  return *std::max_element(values.begin(), values.end());
}

std::optional<Real> median(std::vector<Real> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

TableRow row_of(const std::vector<const StudyResult*>& group) {
  TableRow row{
      .which = group.front()->which, .tetrahedra = group.front()->tetrahedra, .runs = static_cast<int>(group.size())};
  std::vector<Real> to_recover, errors, cpu;
  for (const StudyResult* result : group) {
    if (!result->recovered()) continue;
    ++row.recovered;
    errors.push_back(result->rest_error);
    if (result->to_recover) to_recover.push_back(*result->to_recover);
    if (result->cpu_seconds_to_recover) cpu.push_back(*result->cpu_seconds_to_recover);
  }
  row.rate = wilson_interval(row.recovered, row.runs);
  row.median_to_recover = median(to_recover);
  row.largest_to_recover = largest(to_recover);
  row.largest_error = largest(errors);
  row.median_cpu = median(cpu);
  row.largest_cpu = largest(cpu);
  return row;
}

}  // namespace

std::vector<TableRow> table_rows(const std::vector<StudyResult>& results) {
  std::map<decltype(key_of(results.front())), std::vector<const StudyResult*>> groups;
  for (const StudyResult& result : results) groups[key_of(result)].push_back(&result);
  std::vector<TableRow> rows;
  rows.reserve(groups.size());
  for (const auto& [key, group] : groups) rows.push_back(row_of(group));
  return rows;
}

nlohmann::ordered_json table_json(const std::vector<TableRow>& rows, bool times) {
  using Json = nlohmann::ordered_json;
  const auto or_null = [](const std::optional<Real>& value) { return value ? Json(*value) : Json(); };
  Json table = Json::array();
  for (const TableRow& row : rows) {
    const StudyCase& c = row.which;
    table.push_back({{"suite", c.suite},
                     {"method", c.method},
                     {"precision", c.precision},
                     {"duration", c.duration},
                     {"material", c.material},
                     {"mesh", c.mesh},
                     {"tetrahedra", row.tetrahedra},
                     {"start", c.start},
                     {"runs", row.runs},
                     {"recovered", row.recovered},
                     {"rate", static_cast<Real>(row.recovered) / row.runs},
                     {"rate_low", row.rate.low},
                     {"rate_high", row.rate.high},
                     {"unit", c.is_static() ? "iterations" : "s"},
                     {"median_to_recover", or_null(row.median_to_recover)},
                     {"largest_to_recover", or_null(row.largest_to_recover)},
                     {"largest_rest_error", or_null(row.largest_error)}});
    if (times) {
      table.back()["median_cpu_seconds_to_recover"] = or_null(row.median_cpu);
      table.back()["largest_cpu_seconds_to_recover"] = or_null(row.largest_cpu);
    }
  }
  return table;
}

}  // namespace penalty::study
