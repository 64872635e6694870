// A slab comes down on a ring of jelly, presses it flat and is lifted: the ring has its shape again.
#include <algorithm>
#include <memory>

#include "scenes/drawn_surface.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace press {

constexpr Material jelly{.young = 2e5, .poisson = 0.35, .density = 1000};
constexpr Real damping = 0.01;                          // [s]
constexpr Real margin = 0.02;                           // of contact [m]
constexpr Real slab_width = 2.2, slab_thickness = 0.2;  // [m]
constexpr Real clearance = 0.3, pressed = 0.5;          // of the slab above the ring, at first [m]; of its height
constexpr Real down = 1.2, leaves = 1.8, up = 3;        // when the slab is down, and up again [s]

/// 0: up, 1: down.
Real share_down(Real time) { return smooth_step(time / down) - smooth_step((time - leaves) / (up - leaves)); }

/// What was seen of the ring.
struct Squeeze {
  SurfaceWatch surface;
  Real least_height = infinite;

  void see(const SceneState& state) {
    surface.see(state);
    const Eigen::RowVectorXd y = state.x().row(1);
    least_height = std::min(least_height, y.maxCoeff() - y.minCoeff());
  }
};

BodyMesh body(const SceneOptions& options) { return load_body(options, "torus"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::RowVectorXd y = body.drawn(body.vertices()).row(1);
  const Real height = y.maxCoeff() - y.minCoeff(), top = height + margin;
  const auto slab = [top, height](Real time) {
    const Real way = clearance + (1 - pressed) * height;
    return Pose{.position = {0, top + clearance - way * share_down(time) + slab_thickness / 2, 0}};
  };
  SceneSetup setup{.name = "press",
                   .title = "A ring is pressed flat",
                   .gravity = {0, -9.81, 0},
                   .ground = true,
                   .objects = {{.shape = Block{Vector3(slab_width, slab_thickness, slab_width) / 2}, .path = slab}},
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 26, .elevation = 4, .still_time = leaves}};
  setup.bodies.push_back(soft_object(options, body, jelly, {.position = {0, margin - y.minCoeff(), 0}}));
  const auto squeeze = std::make_shared<Squeeze>(Squeeze{SurfaceWatch({body}, margin)});
  setup.watch = [squeeze](const SceneState& state) { squeeze->see(state); };
  setup.facts = [squeeze, height](const SceneState&) -> std::vector<Fact> {
    return {{"rest_height", height},
            {"least_height", squeeze->least_height},
            {"self_crossings", static_cast<double>(squeeze->surface.self_crossings())}};
  };
  return setup;
}

}  // namespace press

const SceneEntry press_scene{"press", "a slab presses a soft ring flat and is lifted: the ring has its shape again", 5,
                             press::body, press::setup};

}  // namespace penalty::demo
