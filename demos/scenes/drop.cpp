// A mesh falls from 2 m on the ground, where rigid balls lie.
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace {

constexpr Real height = 2;  // of the lowest point [m]
constexpr Material jelly{.young = 4e5, .poisson = 0.4, .density = 1000};
constexpr Real jelly_damping = 0.01;  // [s]
constexpr int num_balls = 11;
constexpr Real ball_density = 1;  // of the soft body's

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

BodyMesh drop_body(const SceneOptions& options) { return load_body(options, "bunny"); }

SceneSetup drop(const SceneOptions& options, const BodyMesh& body) {
  const int count = options.spheres.value_or(num_balls);
  if (count < 0 || count > 1000)
    throw std::invalid_argument("--spheres is " + std::to_string(count) + ", must be 0 to 1000");
  Elasticity elastic = elasticity(options, body.solid(), jelly);

  Eigen::Matrix3Xd positions = start_positions(body.vertices(), options.start.value_or(Start::rest), options.seed);
  positions.row(1).array() += height - body.drawn(positions).row(1).minCoeff();

  return {
      .name = "drop",
      .title = "Drop among rigid balls",
      .bodies = alone({.mesh = body, .field = std::move(elastic.field), .mass = elastic.mass, .positions = positions}),
      .gravity = {0, -9.81, 0},
      .ground = true,
      .objects = scattered(count, ball_density * elastic.mass / volume(body.solid()), options.seed),
      .step = step_options(options, {.damping_time = jelly_damping}),
      .look = {.still_time = 0.76}};  // on the ground, flattest
}

}  // namespace

const SceneEntry drop_scene{"drop", "a mesh, by default the Stanford bunny, falls on the ground among rigid balls", 3,
                            drop_body, drop};

}  // namespace penalty::demo
