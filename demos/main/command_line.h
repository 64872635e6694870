// The command line, checked: whatever comes out of here can be run.
#pragma once
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/context.h"
#include "render/renderer.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

/// What the user asked for cannot be had: status 2. what() is one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

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
  Coloring coloring = Coloring::energy;
  std::optional<Real> still;  // [s]
};

struct CommandLine {
  std::string text;  // to be printed on standard output, then done: help, version, the list of scenes
  std::optional<RunOptions> run;
};

/// Throws UsageError.
CommandLine parse(int argc, const char* const* argv);

/// World steps in a run; throws UsageError if that is none, or more than anybody waits for.
long num_steps(Real duration, Real rate);

/// `what` without line breaks, so that an error stays one line.
std::string one_line(std::string what);

}  // namespace penalty::demo
