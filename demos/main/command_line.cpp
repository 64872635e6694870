#include "main/command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>

#include "main/decimal.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace {

constexpr Real most_steps = 1e7, lowest_rate = 1e-3, highest_rate = 1e6;

std::string scene_list() {
  std::ostringstream text;
  std::size_t width = 0;
  for (const SceneEntry& scene : scenes()) width = std::max(width, scene.name.size());
  for (const SceneEntry& scene : scenes())
    text << scene.name << std::string(width + 2 - scene.name.size(), ' ') << scene.description << '\n';
  return text.str();
}

/// A number as it was typed last, or as it is.
std::string shown(Real value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

void require(bool ok, const std::string& option, Real value, const std::string& range) {
  if (!ok) throw UsageError(option + " is " + shown(value) + ", must be " + range);
}

void require_positive(const std::optional<Real>& value, const std::string& option) {
  if (value) require(*value > 0 && std::isfinite(*value), option, *value, "positive and finite");
}

void require_not_negative(const std::optional<Real>& value, const std::string& option) {
  if (value) require(*value >= 0 && std::isfinite(*value), option, *value, "finite and not negative");
}

std::optional<int> whole(const std::optional<long long>& value, const std::string& option, long long low,
                         long long high) {
  if (!value) return {};
  require(*value >= low && *value <= high, option, static_cast<Real>(*value),
          std::to_string(low) + " to " + std::to_string(high));
  return static_cast<int>(*value);
}

}  // namespace

long num_steps(Real duration, Real rate) {
  const Real steps = std::round(duration * rate);
  if (steps < 1)
    throw UsageError("--duration " + shown(duration) + " at --rate " + shown(rate) + " is less than one step");
  if (!(steps <= most_steps))
    throw UsageError("--duration " + shown(duration) + " at --rate " + shown(rate) + " is more than " +
                     shown(most_steps) + " steps");
  return static_cast<long>(steps);
}

CommandLine parse(int argc, const char* const* argv) {
  CLI::App app{"Soft bodies under penalty forces in Bullet worlds, measured and drawn.", "penalty-demo"};
  app.require_subcommand(1);
  CLI::App* list = app.add_subcommand("list", "Lists the scenes");
  CLI::App* run = app.add_subcommand("run", "Runs a scene");

  RunOptions options;
  SceneOptions& scene = options.scene_options;
  std::string world = "classic", integrator = "auto", start, quality = "preview", backend = "auto", coloring, model;
  std::optional<long long> seed, seeds, cells, order, phases, substeps, spheres;
  std::string out;
  bool no_render = false, no_scale = false;

  run->add_option("scene", options.scene, "One of the scenes of `penalty-demo list`")->required()->type_name("SCENE");
  run->add_option("--world", world, "Bullet's world: classic or deformable")->type_name("NAME");
  run->add_option("--integrator", integrator, "auto, explicit or implicit")->type_name("NAME");
  run->add_option("--order", order, "Of implicit steps: 1 (backward Euler) or 2 (TR-BDF2 where nothing touches)")
      ->type_name("N");
  run->add_option("--mesh", scene.mesh,
                  "Tetrahedra (.vtk, .vtu, .msh, .node/.ele), a surface (.obj, .stl, .ply), or bunny, torus, ball, box")
      ->type_name("FILE");
  run->add_flag("--no-scale", no_scale, "Keep the size of the mesh, else 2 m along its longest side");
  run->add_option("--cells", cells, "Cells along the longest side, where the scene makes the mesh")->type_name("N");
  auto* stiffness =
      run->add_option("--stiffness", scene.stiffness, "K of every constraint [J], for a body of 1 kg")->type_name("J");
  run->add_option("--young", scene.young, "Young's modulus [Pa]")->type_name("PA")->excludes(stiffness);
  run->add_option("--poisson", scene.poisson,
                  "Poisson's ratio, up to 0.5: from 0.25, of springs+areas 0.3, of neo-hookean 0")
      ->type_name("N")
      ->excludes(stiffness);
  run->add_option("--model", model, "Of tetrahedra: springs (and volumes), springs+areas or neo-hookean")
      ->type_name("NAME")
      ->excludes(stiffness);
  run->add_option("--phases", phases, "1, or 2: tetrahedra give way far from their rest shape, and so find back to it")
      ->type_name("N")
      ->excludes(stiffness);
  run->add_option("--damping", scene.damping, "Ratio of damping to stiffness [s]")->type_name("S");
  run->add_option("--drag", scene.drag, "Rate at which velocities decay [1/s]")->type_name("RATE");
  run->add_option("--substeps", substeps, "Substeps in a world step; 0: from the stability limit")->type_name("N");
  run->add_option("--spheres", spheres, "Rigid balls in scene drop")->type_name("N");
  run->add_option("--start", start, "rest, squash, plane, line, point, mirror, scramble or jitter")->type_name("NAME");
  run->add_option("--seed", seed, "Seed of everything random, 0 or more")->type_name("N");
  run->add_option("--seeds", seeds, "Runs with this many seeds, from --seed on")->type_name("N");
  run->add_option("--rate", options.rate, "World steps a second")->type_name("HZ");
  run->add_option("--duration", options.duration, "Simulated time [s]")->type_name("S");
  run->add_option("--out", out, "Directory for still, clip, summary.json, energies.csv and energies.svg")
      ->type_name("DIR");
  run->add_option("--quality", quality, "Of the pictures: preview, video or still")->type_name("NAME");
  run->add_option("--gl", backend, "Off-screen OpenGL: auto, osmesa or egl")->type_name("NAME");
  run->add_option("--color", coloring, "Colours show energy (density) or strain (mean |C| of the edges)")
      ->type_name("NAME");
  run->add_option("--still", options.still, "Moment of the still [s]; else the end")->type_name("S");
  run->add_flag("--no-render", no_render, "No pictures: needs no OpenGL");
  run->add_option("--summary", options.summary, "Where the summary goes as JSON; -: alone on standard output")
      ->type_name("FILE");
  read_as_decimal(*run, {"--cells", "--stiffness", "--young", "--poisson", "--order", "--phases", "--damping", "--drag",
                         "--substeps", "--spheres", "--seed", "--seeds", "--rate", "--duration", "--still"});

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return {run->parsed() ? run->help() : list->parsed() ? list->help() : app.help(), {}};
  } catch (const CLI::ParseError& error) {
    throw UsageError(one_line(error.what()));
  }
  if (list->parsed()) return {scene_list(), {}};

  try {
    find_scene(options.scene);
    options.world = world_from_name(world);
    scene.integrator = integrator_from_name(integrator);
    if (run->count("--start") > 0) scene.start = start_from_name(start);
    if (run->count("--model") > 0) scene.model = model_from_name(model);
    options.quality = render::quality_from_name(quality);
    options.backend = render::backend_from_name(backend);
  } catch (const std::invalid_argument& error) {
    throw UsageError(one_line(error.what()));
  }
  if (run->count("--color") > 0) {
    if (coloring != "energy" && coloring != "strain")
      throw UsageError("unknown colouring \"" + coloring + "\", must be one of energy, strain");
    options.coloring = coloring == "energy" ? Coloring::energy : Coloring::strain;
  }

  require(options.rate >= lowest_rate && options.rate <= highest_rate, "--rate", options.rate,
          shown(lowest_rate) + " to " + shown(highest_rate) + " Hz");
  require_positive(options.duration, "--duration");
  require_positive(scene.stiffness, "--stiffness");
  require_positive(scene.young, "--young");
  require_positive(scene.poisson, "--poisson");
  require_not_negative(scene.damping, "--damping");
  require_not_negative(scene.drag, "--drag");
  require_not_negative(options.still, "--still");
  num_steps(options.duration.value_or(find_scene(options.scene).duration), options.rate);
  scene.cells = whole(cells, "--cells", 1, 1000);
  scene.order = whole(order, "--order", 1, 2);
  scene.phases = whole(phases, "--phases", 1, 2);
  scene.spheres = whole(spheres, "--spheres", 0, 1000);
  scene.substeps = whole(substeps, "--substeps", 0, 1000000);
  if (const auto value = whole(seed, "--seed", 0, 2147483647)) scene.seed = static_cast<std::uint32_t>(*value);
  options.seeds = whole(seeds, "--seeds", 1, 1000000).value_or(0);
  scene.scale = !no_scale;
  options.render = !no_render;
  if (!out.empty()) options.out = out;
  if (run->count("--out") > 0 && out.empty()) throw UsageError("--out is empty, must be a directory");
  if (options.summary && options.summary->empty()) throw UsageError("--summary is empty, must be a file or -");
  return {{}, std::move(options)};
}

}  // namespace penalty::demo
