// A body is put into one impossible shape after another and finds back each time, with nothing but its own forces.
#include <algorithm>
#include <memory>

#include "scenes/scene_setup.h"
#include "scenes/shape_measure.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace recover {

const Material jelly{.young = 1e6, .poisson = 0.35, .density = 1000};  // of two phases
constexpr Real damping = 0.005;                                        // ratio to stiffness [s]
constexpr Real interval = 2;                                           // from one start to the next [s]
constexpr Real recovered_below = 1e-2;                                 // rest error

constexpr Start sequence[] = {Start::scramble, Start::squash, Start::plane,  Start::line,
                              Start::point,    Start::mirror, Start::jitter, Start::scramble};

/// How many of the starts the body had come back from when the next one came.
struct Tally {
  ShapeMeasure measure;
  std::size_t starts = 0, recovered = 0;
  Real worst = 0;

  void count(const Positions& x) {
    const Real error = measure.rest_error(x);
    ++starts;
    if (error < recovered_below) ++recovered;
    worst = std::max(worst, error);
  }
};

BodyMesh body(const SceneOptions& options) { return load_body(options, "torus"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  Elasticity elastic = elasticity(options, body.solid(), jelly, ElasticModel::neo_hookean, 2);
  const Eigen::Matrix3Xd& rest = body.vertices();
  SceneSetup setup{
      .name = "recover",
      .title = options.start ? "Recovery: " + std::string(name_of(*options.start)) : "Recovery",
      .bodies = alone({.mesh = body,
                       .field = std::move(elastic.field),
                       .mass = elastic.mass,
                       .positions = start_positions(rest, options.start.value_or(sequence[0]), options.seed)}),
      .step = step_options(options, {.integrator = Integrator::implicit_step, .damping_time = damping}),
      .look = {.azimuth = 20, .elevation = 18, .still_time = 0.13, .strain = true, .color_high = 1, .reach = 0.85}};
  if (options.start) return setup;

  std::uint32_t seed = options.seed;
  for (std::size_t k = 0; k < std::size(sequence); ++k)
    setup.restarts.push_back({static_cast<Real>(k) * interval, std::string(name_of(sequence[k])),
                              start_positions(rest, sequence[k], seed++)});
  const auto tally = std::make_shared<Tally>(Tally{ShapeMeasure(rest, body.edges(), body.tetrahedra())});
  setup.watch = [tally](const SceneState& state) {
    if (state.time > static_cast<Real>(tally->starts + 1) * interval - 1e-6) tally->count(state.x());
  };
  setup.facts = [tally](const SceneState&) {
    return std::vector<Fact>{{"starts", static_cast<double>(tally->starts)},
                             {"recovered_starts", static_cast<double>(tally->recovered)},
                             {"worst_rest_error", tally->worst}};
  };
  return setup;
}

}  // namespace recover

const SceneEntry recover_scene{"recover",
                               "a body finds back to its rest shape: squashed, flattened, mirrored, scrambled", 16,
                               recover::body, recover::setup};

}  // namespace penalty::demo
