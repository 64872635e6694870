// The command line, checked: whatever comes out of here can be run.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "main/usage_error.h"
#include "render/context.h"
#include "render/renderer.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

enum class Coloring { energy, strain };

struct RunOptions {
  std::string scene;
  WorldKind world = WorldKind::classic;
  SceneOptions scene_options;
  int seeds = 0;                 // 0: one run, no statistics
  Real rate = 60;                // world steps a second
  std::optional<Real> duration;  // [s]
  std::optional<std::filesystem::path> out;
  std::optional<std::string> summary;  // a file, or "-"
  render::Quality quality = render::Quality::preview;
  render::Backend backend = render::Backend::automatic;
  bool render = true;
  std::optional<Coloring> coloring;  // empty: as the scene looks best
  std::optional<Real> still;         // [s]
};

struct CommandLine {
  std::string text;  // to be printed on standard output, then done: help, version, the list of scenes
  std::optional<RunOptions> run;
};

/// Throws UsageError.
CommandLine parse(int argc, const char* const* argv);

/// World steps in a run; throws UsageError if that is none, or more than anybody waits for.
long num_steps(Real duration, Real rate);

}  // namespace penalty::demo
