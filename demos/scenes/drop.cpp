// A mesh falls from 2 m on the ground, where rigid balls lie.
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace drop {

constexpr Real height = 2;  // of the lowest point [m]
constexpr Material jelly{.young = 4e5, .poisson = 0.4, .density = 1000};
constexpr Real jelly_damping = 0.01;  // [s]
constexpr Fabric woven{{.young = 2e5, .poisson = poisson_of_springs, .density = 300},
                       {.thickness = 2e-3, .bending = 0.3}};  // of an open surface
constexpr Real cloth_damping = 0.005;                         // [s]
constexpr int num_balls = 11;
constexpr Real ball_density = 1;          // of a solid's
constexpr Real ball_density_below = 100;  // a cloth [kg/m³]

/// Balls on the ground, spread like the seeds of a sunflower: never touching, and no rows. The middle stays free, so
/// that a body of 2 m comes down between them.
std::vector<RigidObject> scattered(int count, Real density, std::uint32_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random](Real low, Real high) {
    return low + (high - low) * static_cast<Real>(random() >> 11) * 0x1p-53;
  };
  const Real turn = uniform(0, 2 * std::numbers::pi), golden = std::numbers::pi * (3 - std::sqrt(5.0));
  constexpr Real spacing = 0.72, first = 2.2;
  std::vector<RigidObject> balls;
  for (int i = 0; i < count; ++i) {
    const Real distance = spacing * std::sqrt(i + first), angle = turn + golden * i;
    const Real radius = uniform(0.16, 0.32);
    const Vector3 place(distance * std::cos(angle), radius, distance * std::sin(angle));
    balls.push_back({.shape = Ball{radius},
                     .pose = {.position = place},
                     .mass = density * 4 / 3 * std::numbers::pi * radius * radius * radius});
  }
  return balls;
}

BodyMesh body(const SceneOptions& options) { return load_body(options, "bunny"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const int count = options.spheres.value_or(num_balls);
  if (count < 0 || count > 1000)
    throw std::invalid_argument("--spheres is " + std::to_string(count) + ", must be 0 to 1000");
  Eigen::Matrix3Xd positions = start_positions(body.vertices(), options.start.value_or(Start::rest), options.seed);
  positions.row(1).array() += height - body.drawn(positions).row(1).minCoeff();

  const auto falling = [&](PotentialField field, Real mass, Real density, const StepOptions& step) -> SceneSetup {
    return {.name = "drop",
            .title = "Drop among rigid balls",
            .bodies = alone({.mesh = body, .field = std::move(field), .mass = mass, .positions = positions}),
            .gravity = {0, -9.81, 0},
            .ground = true,
            .objects = scattered(count, density, options.seed),
            .step = step_options(options, step),
            .look = {.still_time = 0.76}};  // on the ground, flattest
  };
  if (body.is_shell()) {
    if (options.model) throw std::invalid_argument("--model is for solids, and " + body.source() + " is an open sheet");
    SceneCloth cloth = cloth_of(options, body, woven);
    return falling(std::move(cloth.field), cloth.mass, ball_density_below,
                   {.damping_time = cloth_damping, .drag = 0.3});
  }
  Elasticity elastic = elasticity(options, body.solid(), jelly);
  const Real density = ball_density * elastic.mass / volume(body.solid());
  return falling(std::move(elastic.field), elastic.mass, density, {.damping_time = jelly_damping});
}

}  // namespace drop

const SceneEntry drop_scene{"drop", "a mesh, by default the Stanford bunny, falls on the ground among rigid balls", 3,
                            drop::body, drop::setup};

}  // namespace penalty::demo
