// Three balls of rubber fall side by side, and differ in their restitution alone: the more they have, the higher they
// come, and none comes higher than it was.
#include <algorithm>
#include <array>
#include <memory>

#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace bounce {

constexpr Material rubber{.young = 3e6, .poisson = 0.4, .density = 1000};
constexpr Real damping = 0.008;                    // [s]
constexpr Real gravity = 9.81, fall = 2;           // [m/s²], [m]
constexpr std::array restitutions{0.0, 0.5, 0.9};  // the ground has 1
constexpr Real apart = 2.5, margin = 0.02;         // middles of neighbours, of contact [m]

/// How fast one came down, and up from its first bounce [m/s].
struct Bounce {
  Real down = 0, up = 0;
  bool done = false;

  void see(const Particles& particles) {
    const Real speed = particles.velocities.row(1).mean();
    done = done || (up > 0 && speed < 0);
    if (done) return;
    down = std::max(down, -speed);
    up = std::max(up, speed);
  }
  Real share() const { return down > 0 ? up / down : 0; }
};

BodyMesh body(const SceneOptions& options) { return load_body(options, "ball"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Real lowest = body.drawn(body.vertices()).row(1).minCoeff();
  SceneSetup setup{.name = "bounce",
                   .title = "Restitution 0, 0.5 and 0.9",
                   .gravity = {0, -gravity, 0},
                   .ground = true,
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 0, .elevation = 6, .still_time = 1.15}};
  for (std::size_t k = 0; k < restitutions.size(); ++k) {
    const Real x = apart * (static_cast<Real>(k) - 1);
    setup.bodies.push_back(soft_object(options, body, rubber, {Matrix3::Identity(), {x, fall + margin - lowest, 0}}));
    setup.bodies.back().restitution = restitutions[k];
  }
  const auto bounces = std::make_shared<std::array<Bounce, restitutions.size()>>();
  setup.watch = [bounces](const SceneState& state) {
    for (std::size_t k = 0; k < bounces->size(); ++k) (*bounces)[k].see(state.bodies[k].particles);
  };
  setup.facts = [bounces](const SceneState&) -> std::vector<Fact> {
    return {{"rebound_of_0", (*bounces)[0].share()},
            {"rebound_of_0.5", (*bounces)[1].share()},
            {"rebound_of_0.9", (*bounces)[2].share()}};
  };
  return setup;
}

}  // namespace bounce

const SceneEntry bounce_scene{"bounce", "three rubber balls bounce, of which only the restitution differs", 2.5,
                              bounce::body, bounce::setup};

}  // namespace penalty::demo
