// Two rings of jelly meet in free space, off their middles. They touch, and nothing else acts on them: no edge goes
// through a face, momentum and spin stay, and the energy is never above that of the start.
#include <memory>

#include "scenes/drawn_surface.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace collide {

constexpr Material jelly{.young = 4e5, .poisson = 0.35, .density = 1000};
constexpr Real damping = 0.002;               // [s]
constexpr Real speed = 1.5;                   // of each [m/s]
constexpr Real distance = 1.5, offset = 0.4;  // of each middle from the plane of the hit; of both across [m]
constexpr Real reach = 0.05;                  // of what is measured between them [m]

BodyMesh body(const SceneOptions& options) { return load_body(options, "torus"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  SceneSetup setup{.name = "collide",
                   .title = "Two rings collide",
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 24, .elevation = 18, .still_time = 0.55}};
  for (const Real side : {-1.0, 1.0}) {
    // One lies flat, one stands.
    const Pose pose{side < 0 ? turned(0, Vector3::UnitX()) : turned(90, Vector3::UnitX()),
                    Vector3(side * distance, side * offset / 2, 0)};
    setup.bodies.push_back(soft_object(options, body, jelly, pose));
    setup.bodies.back().velocities = Vector3(-side * speed, 0, 0).replicate(1, body.vertices().cols());
  }
  const auto watch = std::make_shared<SurfaceWatch>(std::vector<BodyMesh>{body, body}, reach);
  setup.watch = [watch](const SceneState& state) { watch->see(state); };
  const Real momentum = setup.bodies[0].mass * speed;
  setup.facts = [watch, momentum](const SceneState& state) -> std::vector<Fact> {
    const Vector3 start(momentum, 0, 0);
    return {{"crossings", static_cast<double>(watch->crossings())},
            {"self_crossings", static_cast<double>(watch->self_crossings())},
            {"least_distance", watch->least_distance()},
            {"exchanged_momentum", (linear_momentum(state.bodies[0].particles) - start).norm() / momentum}};
  };
  return setup;
}

}  // namespace collide

const SceneEntry collide_scene{"collide", "two soft rings hit each other in free space, off their middles", 2,
                               collide::body, collide::setup};

}  // namespace penalty::demo
