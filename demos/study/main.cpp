// penalty-study: how often and how fast bodies recover from hard starts.
#include <iostream>
#include <set>

#include "main/progress.h"
#include "penalty/mesh/tet_mesh.h"
#include "study/command_line.h"
#include "study/impacts.h"
#include "study/plot.h"
#include "study/results_directory.h"
#include "study/run_suite.h"
#include "study/stability.h"

namespace {

using namespace penalty;
using namespace penalty::study;

enum Status { done = 0, failed = 1, misused = 2 };

/// The user's mesh is read before anything is made, and refused in one line.
void add_mesh(RunCommand& command, StudyMeshes& meshes) try {
  if (!command.mesh.empty()) command.options.file_mesh = meshes.add_file(command.mesh);
} catch (const MeshError& error) {
  throw demo::UsageError(demo::one_line(error.what()));
} catch (const std::invalid_argument& error) {
  throw demo::UsageError(demo::one_line(error.what()));
}

Status execute(const std::string& text) {
  std::cout << text << std::flush;
  return done;
}

Status execute(RunCommand command) {
  StudyMeshes meshes;
  add_mesh(command, meshes);
  const std::vector<StudyCase> suite = find_suite(command.suite).cases(command.options);
  ResultFile file(command.out, command.shard, command.num_shards);
  std::set<std::string> there;
  for (const StudyResult& result : read_results({command.out})) there.insert(result.which.id());

  std::vector<StudyCase> missing;
  const std::vector<StudyCase> shard = shard_of(suite, command.shard, command.num_shards);
  for (const StudyCase& c : shard)
    if (!there.contains(c.id())) missing.push_back(c);
  for (const StudyCase& c : missing) meshes.load(c.mesh);
  {
    demo::Progress progress(command.suite, static_cast<long>(missing.size()));
    long finished = 0;
    run_suite(missing, meshes, command.jobs, [&](const StudyResult& result) {
      file.append(result);
      progress.advance_to(++finished);
    });
  }
  std::cout << "suite " << command.suite << ", shard " << command.shard << " of " << command.num_shards << ": "
            << missing.size() << " cases run, " << shard.size() - missing.size() << " were there\n"
            << std::flush;
  return done;
}

std::vector<TableRow> rows_of(const std::vector<std::filesystem::path>& paths) {
  return table_rows(merged(read_results(paths)));
}

Status execute(const TableCommand& command) {
  const std::vector<TableRow> rows = rows_of(command.paths);
  std::cout << (command.json ? table_json(rows, command.times).dump(2) + "\n" : table_text(rows, command.times))
            << std::flush;
  return done;
}

Status execute(const PlotCommand& command) {
  write_rate_plot(command.out, rows_of(command.paths));
  return done;
}

Status execute(const StabilityCommand& command) {
  constexpr Real flight = 2, chain = 10, impact = 4;  // [s]
  StabilityTable table;
  ImpactTable impacts;
  {
    demo::Progress progress("stability", 2000);
    table = measure_stability(command.time.value_or(flight), command.time.value_or(chain),
                              [&](Real share) { progress.advance_to(static_cast<long>(1000 * share)); });
    impacts = measure_impacts(command.time.value_or(impact),
                              [&](Real share) { progress.advance_to(static_cast<long>(1000 * (1 + share))); });
  }
  std::cout << table.text() << '\n' << impacts.text() << std::flush;
  if (table.is_stable() && impacts.is_stable()) return done;
  std::cerr << "penalty-study: a step was not finite, or energy was gained\n";
  return failed;
}

}  // namespace

int main(int argc, char** argv) try {
  const Status status =
      std::visit([](auto&& command) { return execute(std::forward<decltype(command)>(command)); }, parse(argc, argv));
  if (!std::cout) throw demo::UsageError("standard output cannot be written");
  return status;
} catch (const demo::UsageError& error) {
  std::cerr << "penalty-study: " << error.what() << '\n';
  return misused;
} catch (const std::bad_alloc&) {
  std::cerr << "penalty-study: not enough memory\n";
  return failed;
} catch (const std::exception& error) {
  std::cerr << "penalty-study: " << demo::one_line(error.what()) << '\n';
  return failed;
}
