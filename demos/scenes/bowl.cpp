// Rings, balls and boxes of jelly fall into a bowl, and rigid balls with them. At the end nothing is inside anything else.
#include <cmath>
#include <memory>
#include <random>

#include "scenes/drawn_surface.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace bowl {

constexpr Material jelly{.young = 8e5, .poisson = 0.35, .density = 300};
constexpr Real damping = 0.04;                            // [s]
constexpr int num_soft = 10, num_balls = 4, abreast = 4;  // at the same height; the balls are the highest
constexpr Real lowest = 2.2, apart = 3.1, circle = 2.2;   // where they start: heights, from the axis [m]
constexpr Real ball_radius = 0.9, ball_density = 200;     // [m], [kg/m³]
constexpr int num_walls = 8;
constexpr Real floor_radius = 3, wall_height = 4, wall_thickness = 0.3, steepness = 55;  // [m], [degrees]
constexpr Real tolerance = 1e-3;                                                         // of what counts as inside [m]

BodyMesh mesh_of(SceneOptions options, const std::string& name, int cells) {
  if (options.mesh.empty()) options.cells = options.cells.value_or(cells);
  return load_body(options, name);
}

BodyMesh body(const SceneOptions& options) { return mesh_of(options, "torus", 18); }

/// Blocks around the floor that lean outwards.
std::vector<RigidObject> walls() {
  const Real half_sector = std::numbers::pi / num_walls, tilt = steepness * std::numbers::pi / 180;
  const Real top_radius = floor_radius + wall_height * std::cos(tilt);
  const Vector3 half(wall_thickness / 2, wall_height / 2, top_radius * std::tan(half_sector));
  std::vector<RigidObject> walls;
  for (int k = 0; k < num_walls; ++k) {
    const Matrix3 rotation = turned(360.0 * k / num_walls, Vector3::UnitY()) * turned(steepness - 90, Vector3::UnitZ());
    const Vector3 foot = turned(360.0 * k / num_walls, Vector3::UnitY()) * Vector3(floor_radius, 0, 0);
    walls.push_back(
        {.shape = Block{half}, .pose = {rotation, foot + rotation * Vector3(half.x(), half.y(), 0)}, .scenery = true});
  }
  return walls;
}

/// Pairs of a soft body and another, a rigid object or the floor, one of which reaches further into the other than
/// `tolerance`; of two soft ones, at all.
int overlapping_pairs(const SceneState& state, const std::vector<RigidObject>& objects, const SurfaceWatch& watch) {
  int pairs = watch.overlapping_pairs();
  for (const DrawnSurface& surface : watch.surfaces()) {
    pairs += surface.vertices().row(1).minCoeff() < -tolerance;
    for (std::size_t k = 0; k < objects.size(); ++k) {
      const Vector3& middle = state.objects[k].position;
      const auto* ball = std::get_if<Ball>(&objects[k].shape);
      bool inside = ball && (surface.encloses(middle) || surface.distance(middle) < ball->radius - tolerance);
      for (Eigen::Index i = 0; !inside && i < surface.vertices().cols(); ++i)
        inside = depth(objects[k], state.objects[k], surface.vertices().col(i)) > tolerance;
      pairs += inside;
    }
  }
  return pairs;
}

/// Bodies whose middle is not in the bowl.
int escaped(const SceneState& state) {
  int count = 0;
  for (const SoftState& body : state.bodies) {
    const Vector3 middle = body.particles.positions.rowwise().mean().head<3>();
    count += !(middle.y() > 0 && std::hypot(middle.x(), middle.z()) < floor_radius + wall_height);
  }
  return count;
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  std::vector<BodyMesh> kinds{body};
  if (options.mesh.empty()) {
    kinds.push_back(mesh_of(options, "ball", 10));
    kinds.push_back(mesh_of(options, "box", 8));
  }
  SceneSetup setup{.name = "bowl",
                   .title = "Into a bowl",
                   .gravity = {0, -9.81, 0},
                   .ground = true,
                   .objects = walls(),
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 24, .elevation = 42}};
  std::mt19937_64 random(options.seed);
  const auto uniform = [&random] { return static_cast<Real>(random() >> 11) * 0x1p-52 - 1; };  // -1 to 1
  std::vector<BodyMesh> meshes;
  for (int k = 0; k < num_soft + num_balls; ++k) {
    const int layer = k / abreast;
    const Matrix3 around = turned(360.0 / abreast * (k + 0.5 * layer), Vector3::UnitY());
    const Vector3 place = around * Vector3(circle, lowest + apart * layer, 0);
    if (k >= num_soft) {
      const Real mass = ball_density * 4 / 3 * std::numbers::pi * ball_radius * ball_radius * ball_radius;
      setup.objects.push_back({.shape = Ball{ball_radius}, .pose = {.position = place}, .mass = mass});
      continue;
    }
    const Real x = uniform(), y = uniform(), z = uniform();
    meshes.push_back(kinds[k % kinds.size()]);
    setup.bodies.push_back(soft_object(options, meshes.back(), jelly, {turned(180 * x, Vector3(y, 1.01, z)), place}));
  }
  const auto surfaces = std::make_shared<SurfaceWatch>(meshes, tolerance);
  setup.watch = [surfaces](const SceneState& state) { surfaces->see(state); };
  setup.facts = [surfaces, objects = setup.objects](const SceneState& state) -> std::vector<Fact> {
    return {{"soft_bodies", static_cast<double>(state.bodies.size())},
            {"crossings", static_cast<double>(surfaces->crossings())},
            {"self_crossings", static_cast<double>(surfaces->self_crossings())},
            {"overlapping_pairs", static_cast<double>(overlapping_pairs(state, objects, *surfaces))},
            {"escaped", static_cast<double>(escaped(state))}};
  };
  return setup;
}

}  // namespace bowl

const SceneEntry bowl_scene{"bowl", "soft rings, balls and boxes fall into a bowl, with rigid balls among them", 6,
                            bowl::body, bowl::setup};

}  // namespace penalty::demo
