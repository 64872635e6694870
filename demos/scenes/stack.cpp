// Boxes of jelly and of wood, one on the other. The pile settles, stands and comes to rest.
#include <algorithm>
#include <memory>

#include "penalty/mesh/builders.h"
#include "scenes/drawn_surface.h"
#include "scenes/motion_watch.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace stack {

constexpr Material jelly{.young = 4e5, .poisson = 0.35, .density = 1000};
constexpr Real damping = 0.06;                                // [s]
constexpr Real width = 0.9, height = 0.6;                     // of a soft box [m]
constexpr Real slab_width = 1.1, slab_height = 0.2;           // of a rigid one [m]
constexpr Real wood = 500;                                    // [kg/m³]
constexpr Real gap = 0.04;                                    // between them, at the start [m]
constexpr Real reach = 0.05;                                  // of what is measured between soft boxes [m]
constexpr Real twist = 14;                                    // of each against the one below [degrees]
constexpr bool is_soft[] = {true, true, false, true, false};  // from below

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "stack");
  const int cells = cells_in(options, 6, 2, 30);
  TetMesh box = make_box({width, height, width}, {cells, std::max(1, 2 * cells / 3), cells});
  box.vertices.colwise() -= Vector3(width, height, width) / 2;
  return {std::move(box)};
}

/// Height of the middle of each, in the order of the pile.
std::vector<Real> heights(const SceneState& state) {
  std::vector<Real> heights;
  std::size_t soft = 0, rigid = 0;
  for (const bool is_jelly : is_soft)
    heights.push_back(is_jelly ? state.x(soft++).row(1).mean() : state.objects[rigid++].position.y());
  return heights;
}

/// How far the middle of any has moved sideways [m]: all began above the origin.
Real lean(const SceneState& state) {
  Real most = 0;
  for (std::size_t b = 0; b < state.bodies.size(); ++b)
    most = std::max(most, std::hypot(state.x(b).row(0).mean(), state.x(b).row(2).mean()));
  for (const Pose& pose : state.objects) most = std::max(most, std::hypot(pose.position.x(), pose.position.z()));
  return most;
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  SceneSetup setup{.name = "stack",
                   .title = "A pile of soft and rigid boxes",
                   .gravity = {0, -9.81, 0},
                   .ground = true,
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 32, .elevation = 14}};
  Real top = 0, angle = 0;
  for (const bool is_jelly : is_soft) {
    const Real thickness = is_jelly ? height : slab_height;
    const Pose pose{turned(angle, Vector3::UnitY()), {0, top + gap + thickness / 2, 0}};
    if (is_jelly)
      setup.bodies.push_back(soft_object(options, body, jelly, pose));
    else
      setup.objects.push_back({.shape = Block{Vector3(slab_width, slab_height, slab_width) / 2},
                               .pose = pose,
                               .mass = wood * slab_width * slab_height * slab_width});
    top += gap + thickness;
    angle += twist;
  }
  const auto surfaces = std::make_shared<SurfaceWatch>(std::vector<BodyMesh>(setup.bodies.size(), body), reach);
  const auto motion = std::make_shared<MotionWatch>();
  setup.watch = [surfaces, motion](const SceneState& state) {
    surfaces->see(state);
    motion->see(state);
  };
  setup.facts = [surfaces, motion](const SceneState& state) -> std::vector<Fact> {
    const std::vector<Real> order = heights(state);
    return {{"crossings", static_cast<double>(surfaces->crossings())},
            {"least_distance", surfaces->least_distance()},
            {"in_order", std::is_sorted(order.begin(), order.end()) ? 1.0 : 0.0},
            {"pile_height", order.back() + slab_height / 2},
            {"lean", lean(state)},
            {"residual_speed", motion->mean_speed()},
            {"shake", motion->speed()}};
  };
  return setup;
}

}  // namespace stack

const SceneEntry stack_scene{"stack", "boxes of jelly with rigid ones between and above them stand and come to rest", 6,
                             stack::body, stack::setup};

}  // namespace penalty::demo
