// Two rings of jelly on a slope of 20 degrees, of which only the friction differs: one stays, one slides as a mass point
// would, by g (sin a - mu cos a).
#include <array>
#include <cmath>
#include <memory>

#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace incline {

constexpr Material jelly{.young = 4e5, .poisson = 0.35, .density = 1000};
constexpr Real damping = 0.02;                                           // [s]
constexpr Real gravity = 9.81, angle = 20;                               // [m/s²], [degrees]
constexpr Real sticking = 0.6, sliding = 0.2;                            // coefficients of friction; tan 20° is 0.36
constexpr Real margin = 0.02;                                            // of contact [m]
constexpr Real half_length = 5, half_width = 2.8, half_thickness = 0.2;  // of the slope [m]
constexpr Real settled = 1;                                              // from when on they are measured [s]

const Matrix3 tilted = turned(-angle, Vector3::UnitZ());  // downhill is its x

/// How far the middle of a body has come downhill, from when it was settled on.
struct Way {
  std::vector<Real> times, ways;

  void see(Real time, const PackedVectors& x) {
    if (time < settled) return;
    times.push_back(time);
    ways.push_back(tilted.col(0).dot(Vector3(x.rowwise().mean().head<3>())));
  }
  Real total() const { return ways.empty() ? 0 : ways.back() - ways.front(); }

  /// From the first, the middle and the last of them [m/s²].
  Real acceleration() const {
    if (ways.size() < 3) return 0;
    const std::size_t half = (ways.size() - 1) / 2;
    const Real duration = times[half] - times[0];
    return (ways[2 * half] - 2 * ways[half] + ways[0]) / (duration * duration);
  }
};

BodyMesh body(const SceneOptions& options) { return load_body(options, "torus"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Real lowest = body.drawn(body.vertices()).row(1).minCoeff();
  const Vector3 middle(0, half_length * std::sin(angle * std::numbers::pi / 180) + 0.3, 0);
  SceneSetup setup{.name = "incline",
                   .title = "Friction on a slope",
                   .gravity = {0, -gravity, 0},
                   .ground = true,
                   .objects = {{.shape = Block{{half_length, half_thickness, half_width}},
                                .pose = {tilted, middle - half_thickness * tilted.col(1)},
                                .friction = 1,
                                .scenery = true}},
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 24, .elevation = 18}};
  for (const bool slides : {false, true}) {
    const Vector3 on_slope(-half_length + 1.3, margin - lowest, slides ? 1.4 : -1.4);
    setup.bodies.push_back(soft_object(options, body, jelly, {tilted, middle + tilted * on_slope}));
    setup.bodies.back().friction = slides ? sliding : sticking;
  }
  const auto ways = std::make_shared<std::array<Way, 2>>();
  setup.watch = [ways](const SceneState& state) {
    for (std::size_t b = 0; b < ways->size(); ++b) (*ways)[b].see(state.time, state.x(b));
  };
  setup.facts = [ways](const SceneState&) -> std::vector<Fact> {
    const Real a = angle * std::numbers::pi / 180;
    return {{"creep", (*ways)[0].total()},
            {"slid", (*ways)[1].total()},
            {"acceleration", (*ways)[1].acceleration()},
            {"acceleration_of_a_point", gravity * (std::sin(a) - sliding * std::cos(a))}};
  };
  return setup;
}

}  // namespace incline

const SceneEntry incline_scene{"incline", "of two soft rings on a slope the rough one stays and the smooth one slides",
                               2.6, incline::body, incline::setup};

}  // namespace penalty::demo
