// penalty-demo: runs a scene in a Bullet world, measures it, draws it.
#include <cstdio>
#include <fstream>
#include <iostream>

#include "main/command_line.h"
#include "main/outputs.h"
#include "main/pictures.h"
#include "main/progress.h"
#include "main/recording.h"
#include "main/summary.h"

namespace {

using namespace penalty;
using namespace penalty::demo;

enum Status { done = 0, failed = 1, misused = 2, not_finite = 3 };

/// Files are opened before the run: who mistyped a path is told at once, not after an hour.
std::optional<std::ofstream> open_summary(const RunOptions& options) {
  if (!options.summary || *options.summary == "-") return {};
  std::ofstream file(*options.summary);
  if (!file) throw UsageError("--summary " + options.summary.value_or("") + ": cannot be written");
  return file;
}

void make_directory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory))
    throw UsageError("--out " + directory.string() + ": cannot be made a directory");
  if (!std::ofstream(directory / "summary.json"))
    throw UsageError("--out " + directory.string() + ": cannot be written to");
}

BodyMesh load(const SceneEntry& entry, const SceneOptions& options) try {
  return entry.body(options);
} catch (const MeshError& error) {
  throw UsageError(one_line(error.what()));
} catch (const std::invalid_argument& error) {
  throw UsageError(one_line(error.what()));
}

std::unique_ptr<Scene> enter_world(const SceneEntry& entry, const RunOptions& options, const BodyMesh& body) try {
  return std::make_unique<Scene>(entry.setup(options.scene_options, body), options.world);
} catch (const std::invalid_argument& error) {
  throw UsageError(one_line(error.what()));
}

std::vector<Figure> make_figures(const SceneEntry& entry, const SceneOptions& options) try {
  return entry.figures(options);
} catch (const std::invalid_argument& error) {
  throw UsageError(one_line(error.what()));
}

struct Run {
  std::unique_ptr<Scene> scene;  // at its end
  Recording recording;
};

bool worse(const Run& a, const Run& b) {
  if (a.recording.finite != b.recording.finite) return !a.recording.finite;
  return a.recording.rest_error > b.recording.rest_error;
}

/// Writes the summary to wherever it is wanted, `description` if it is wanted nowhere.
void hand_out(const nlohmann::ordered_json& summary, const std::string& description, const RunOptions& options,
              std::optional<std::ofstream>& file) {
  const std::string text = summary.dump(2) + "\n";
  if (file) *file << text << std::flush;
  if (options.summary == "-") std::cout << text << std::flush;
  if (!options.summary) std::cout << description << std::flush;
  if (options.out && !(std::ofstream(*options.out / "summary.json") << text << std::flush))
    throw UsageError("--out " + options.out->string() + ": summary.json cannot be written");
  if (file && !*file) throw UsageError("--summary " + options.summary.value_or("") + ": cannot be written");
}

Status run_figures(const SceneEntry& entry, const RunOptions& options) {
  const std::vector<Figure> figures = make_figures(entry, options.scene_options);
  std::optional<std::ofstream> summary_file = open_summary(options);
  if (options.out) make_directory(*options.out);
  hand_out(summarize(figures, options), describe(figures), options, summary_file);
  if (options.render && options.out) {
    const Real duration = options.duration.value_or(entry.duration);
    Progress progress("drawing", static_cast<long>(figures.size()) + num_figure_frames(duration));
    const std::string remarks =
        draw(figures, options, duration, *options.out, [&](long drawn) { progress.advance_to(drawn); });
    if (!remarks.empty()) std::cerr << "penalty-demo: " << remarks << '\n';
  }
  return done;
}

Status run(RunOptions options) {
  const SceneEntry& entry = find_scene(options.scene);
  if (entry.figures) return run_figures(entry, options);
  const Real duration = options.duration.value_or(entry.duration);
  const long steps = num_steps(duration, options.rate);
  const bool draws = options.render && options.out.has_value();
  const FramePlan frames = draws ? plan_frames(duration, options.rate) : FramePlan{};
  const BodyMesh body = load(entry, options.scene_options);
  std::optional<std::ofstream> summary_file = open_summary(options);
  if (options.out) make_directory(*options.out);

  // Of several runs the worst is described and drawn.
  const int runs = std::max(options.seeds, 1);
  int recovered = 0;
  nlohmann::ordered_json each_seed = nlohmann::ordered_json::array();
  const Run worst = [&] {
    Progress progress(options.scene, steps * runs);
    const auto run_once = [&](int r) -> Run {
      std::unique_ptr<Scene> scene = enter_world(entry, options, body);
      Recording recording =
          record(*scene, options, steps, frames, [&](long step) { progress.advance_to(r * steps + step); });
      recovered += recording.recovered();
      each_seed.push_back(
          {{"seed", recording.seed}, {"rest_error", recording.rest_error}, {"recovered", recording.recovered()}});
      ++options.scene_options.seed;
      return {std::move(scene), std::move(recording)};
    };
    Run worst_so_far = run_once(0);
    for (int r = 1; r < runs; ++r)
      if (Run other = run_once(r); worse(other, worst_so_far)) worst_so_far = std::move(other);
    return worst_so_far;
  }();
  const Recording& recording = worst.recording;

  nlohmann::ordered_json summary = summarize(recording, options, worst.scene->setup());
  if (options.seeds > 0) {
    summary["runs"] = runs;
    summary["recovered_runs"] = recovered;
    summary["each_seed"] = each_seed;
  }
  hand_out(summary, describe(summary, recording.facts), options, summary_file);
  if (options.out) {
    write_csv(*options.out / "energies.csv", recording.steps);
    write_energy_plot(*options.out / "energies.svg", "Energies, scene " + options.scene, recording.steps);
  }

  if (draws) {
    Progress progress("drawing", static_cast<long>(recording.frames.size()) + 1);
    const std::string remarks = draw(recording, options, worst.scene->setup(), frames, *options.out,
                                     [&](long drawn) { progress.advance_to(drawn); });
    if (!remarks.empty()) std::cerr << "penalty-demo: " << remarks << '\n';
  }
  if (!recording.finite) {
    std::cerr << "penalty-demo: " << recording.failure << '\n';
    return not_finite;
  }
  return done;
}

}  // namespace

int main(int argc, char** argv) try {
  CommandLine command_line = parse(argc, argv);
  std::cout << command_line.text << std::flush;
  const Status status = command_line.run ? run(std::move(*command_line.run)) : done;
  if (!std::cout) throw UsageError("standard output cannot be written");
  return status;
} catch (const UsageError& error) {
  std::cerr << "penalty-demo: " << error.what() << '\n';
  return misused;
} catch (const std::bad_alloc&) {
  std::cerr << "penalty-demo: not enough memory\n";
  return failed;
} catch (const std::exception& error) {
  std::cerr << "penalty-demo: " << one_line(error.what()) << '\n';
  return failed;
}
