// A cloth falls, folded, on a ball and from there on the floor: it lies on itself in layers.
#include <cmath>
#include <memory>
#include <numbers>

#include "penalty/mesh/surface_builders.h"
#include "scenes/drawn_surface.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace fold {

constexpr Real width = 1, length = 1.4;  // [m]
constexpr Fabric woven{{.young = 2e5, .poisson = poisson_of_springs, .density = 300},
                       {.thickness = 1e-3, .bending = 0.3}};
constexpr Real damping = 0.005;                      // [s]
constexpr Real ball_radius = 0.2, clearance = 0.12;  // between ball and cloth [m]
constexpr Real fold_radius = 0.04, wave = 0.02;      // of the fold at the top, of the waves of both layers [m]
constexpr Real kept_share = 0.3, margin = 0.02;      // of the mean edge, at most: what layers keep [m]

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "fold");
  refuse_model(options, "fold");
  const int cells = cells_in(options, 38, 4, 200);
  return {make_sheet(width, length, cells, static_cast<int>(std::lround(cells * length / width)))};
}

/// Up on one side, over a half circle, and down on the other: every edge has nearly its rest length.
Eigen::Matrix3Xd folded_over(const Eigen::Matrix3Xd& flat) {
  const Real arc = std::numbers::pi * fold_radius, side = (length - arc) / 2, bottom = 2 * ball_radius + clearance;
  Eigen::Matrix3Xd x(3, flat.cols());
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const Real s = flat(1, i), along = flat(0, i) - width / 2;
    const Real over = std::clamp((s - side) / fold_radius, Real(0), std::numbers::pi);
    const Real down = std::max<Real>(s - side - arc, 0);
    x.col(i) << along, bottom + std::min(s, side) + fold_radius * std::sin(over) - down,
        -fold_radius * std::cos(over) + wave * std::sin(7 * along + 3 * s);
  }
  return x;
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  SceneCloth sheet = cloth_of(options, body, woven);
  const Start start = options.start.value_or(Start::rest);
  const Eigen::Matrix3Xd folded = folded_over(rest);
  const std::vector<Edge> edges = body.edges();
  Real length_of_all = 0;
  for (const auto& [i, j] : edges) length_of_all += (rest.col(i) - rest.col(j)).norm();
  const Real kept = std::min(margin, kept_share * length_of_all / static_cast<Real>(edges.size()));
  const auto layers = std::make_shared<SurfaceWatch>(std::vector<BodyMesh>{body}, kept);
  return {.name = "fold",
          .title = "Cloth falls folded on a ball",
          .bodies = alone({.mesh = body,
                           .field = std::move(sheet.field),
                           .mass = sheet.mass,
                           .positions = start == Start::rest ? folded : start_positions(folded, start, options.seed)}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .objects = {{.shape = Ball{ball_radius}, .pose = {.position = {0.05, ball_radius, 0.02}}}},
          .step = step_options(options, {.damping_time = damping, .drag = 0.3}),
          .look = {.azimuth = 32, .elevation = 18, .wire = false},
          .watch = [layers](const SceneState& state) { layers->see(state); },
          .facts = [layers, kept](const SceneState&) -> std::vector<Fact> {
            return {{"self_crossings", static_cast<double>(layers->self_crossings())},
                    {"kept_distance", kept},
                    {"least_distance", layers->least_distance()}};
          }};
}

}  // namespace fold

const SceneEntry fold_scene{"fold", "a cloth falls folded on a ball and lies on itself", 3, fold::body, fold::setup};

}  // namespace penalty::demo
