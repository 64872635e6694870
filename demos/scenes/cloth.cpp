// A sheet of cloth of 2 x 2 m, held at its corners, sags in folds and catches a ball.
#include <cmath>
#include <stdexcept>

#include "penalty/mesh/surface_builders.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace cloth {

constexpr Real size = 2, height = 1;  // [m]
constexpr Fabric canvas{{.young = 8e5, .poisson = poisson_of_springs, .density = 300}, {.thickness = 1e-3}};
constexpr Real slack = 0.9;                                       // distance of the corners, of that in the flat sheet
constexpr int pleats = 8;                                         // of the start, across its width
constexpr Real damping = 0.01;                                    // [s]
constexpr Real ball_radius = 0.25, ball_mass = 1.5, fall = 0.55;  // [m], [kg], [m]

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "cloth");
  refuse_model(options, "cloth");
  const int cells = cells_in(options, 48, 2, 400);
  TriangleSurface sheet = make_sheet(size, size, cells, cells);
  const Eigen::Matrix3Xd upright = sheet.vertices;
  sheet.vertices.row(0).array() -= size / 2;
  sheet.vertices.row(1).setConstant(height);
  sheet.vertices.row(2) = size / 2 - upright.row(1).array();  // level, its front up
  return {std::move(sheet)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  const auto num_vertices = static_cast<int>(rest.cols());
  SceneCloth sheet = cloth_of(options, body, canvas);

  const int side = static_cast<int>(std::lround(std::sqrt(num_vertices)));
  const std::vector<int> corners{0, side - 1, num_vertices - side, num_vertices - 1};
  Eigen::Matrix3Xd positions = start_positions(rest, options.start.value_or(Start::rest), options.seed);
  Eigen::Matrix3Xd folded = rest;
  // Pleated like a fan, along lines of the mesh: narrower than flat, and yet every edge has its rest length.
  const int cells = side - 1, pleat = std::max(1, cells / pleats);
  const Real rise = std::sqrt(1 - slack * slack) * size / cells;
  for (int i = 0; i < num_vertices; ++i) {
    const int column = i % side, phase = column % (2 * pleat);
    folded.col(i) << slack * rest(0, i), height - rise * std::min(phase, 2 * pleat - phase), rest(2, i);
  }
  if (options.start.value_or(Start::rest) == Start::rest) positions = folded;
  for (int i : corners) positions.col(i) = folded.col(i);

  std::vector<RigidObject> balls;
  if (options.spheres.value_or(1) > 1) throw std::invalid_argument("--spheres: scene cloth has one ball or none");
  if (options.spheres.value_or(1) == 1)
    balls.push_back({.shape = Ball{ball_radius}, .pose = {.position = {0.12, height + fall, 0.08}}, .mass = ball_mass});
  return {.name = "cloth",
          .title = "Cloth catches a ball",
          .bodies = alone({.mesh = body,
                           .field = std::move(sheet.field),
                           .mass = sheet.mass,
                           .positions = positions,
                           .pinned = corners}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .objects = balls,
          .step = step_options(options, {.damping_time = damping, .drag = 0.3}),
          .look = {.azimuth = 24, .elevation = 22, .still_time = 1.2},
          .facts = [](const SceneState& state) -> std::vector<Fact> {
            return {{"sag", height - state.x().row(1).minCoeff()}};
          }};
}

}  // namespace cloth

const SceneEntry cloth_scene{"cloth", "a sheet, held at its corners, catches a ball", 4, cloth::body, cloth::setup};

}  // namespace penalty::demo
