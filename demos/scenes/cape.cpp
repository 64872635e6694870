// A wearer runs round in a circle and stops; a cape, pinned at the shoulders, streams behind and swings forward.
#include <algorithm>
#include <cmath>
#include <memory>

#include "penalty/mesh/surface_builders.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace cape {

constexpr Real width = 0.5, length = 0.9;  // [m]
constexpr Fabric woven{{.young = 6e5, .poisson = poisson_of_springs, .density = 300},
                       {.thickness = 1e-3, .bending = 0.3}};
constexpr Real damping = 0.005, drag = 1.5;                           // [s], of the air [1/s]
const Vector3 wearer(0.12, 0.72, 0.22);                               // half extents, the first forward [m]
constexpr Real height = 0.74, behind = 0.04;                          // of its middle, of the cape at its back [m]
constexpr Real speed = 5, radius = 2;                                 // [m/s], [m]
constexpr Real starts = 0.4, runs = 1.2, brakes = 2.9, stands = 3.5;  // when [s]

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "cape");
  refuse_model(options, "cape");
  const int cells = cells_in(options, 14, 2, 100);
  return {make_sheet(width, length, cells, static_cast<int>(std::lround(cells * length / width)))};
}

// Seconds of full speed that a change from none to it between two times is worth.
Real full_seconds(Real time, Real from, Real to) {
  const Real changing = std::clamp<Real>(time - from, 0, to - from);
  return changing * changing / 2 / (to - from) + std::max<Real>(time - to, 0);
}

Pose wearer_pose(Real time) {
  const Real way = speed * (full_seconds(time, starts, runs) - full_seconds(time, brakes, stands));
  const Real angle = way / radius;
  return {Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix(),
          {radius * std::sin(angle), height, radius * (std::cos(angle) - 1)}};
}

/// How long the edges became, in all steps.
class Stretch {
 public:
  explicit Stretch(const BodyMesh& body) : edges_(body.edges()), rest_(body.vertices()) {}

  void see(const SceneState& state) {
    for (const auto& [a, b] : edges_) {
      const Real now = (state.x().col(a) - state.x().col(b)).norm();
      longest_ = std::max(longest_, now / (rest_.col(a) - rest_.col(b)).norm());
    }
    for (Eigen::Index i = 0; i < state.x().cols(); ++i)
      furthest_ = std::max(furthest_, -state.objects[0].local(state.x().col(i).head<3>()).x());
  }
  std::vector<Fact> facts() const {
    return {{"longest_edge", longest_}, {"furthest_behind", furthest_}, {"speed", speed}};
  }

 private:
  std::vector<Edge> edges_;
  Eigen::Matrix3Xd rest_;
  Real longest_ = 0, furthest_ = 0;
};

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  SceneCloth sheet = cloth_of(options, body, woven);

  Eigen::Matrix3Xd hanging(3, rest.cols());
  std::vector<int> shoulders;
  for (int i = 0; i < rest.cols(); ++i) {
    hanging.col(i) << -wearer.x() - behind, height + wearer.y() - length + rest(1, i), rest(0, i) - width / 2;
    if (rest(1, i) > length - 1e-9) shoulders.push_back(i);
  }
  Eigen::Matrix3Xd positions = start_positions(hanging, options.start.value_or(Start::rest), options.seed);
  for (const int i : shoulders) positions.col(i) = hanging.col(i);

  const auto stretch = std::make_shared<Stretch>(body);
  return {.name = "cape",
          .title = "A cape follows its wearer",
          .bodies = alone({.mesh = body,
                           .field = std::move(sheet.field),
                           .mass = sheet.mass,
                           .positions = positions,
                           .pinned = shoulders,
                           .carrier = 0}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .objects = {{.shape = Block{wearer}, .path = wearer_pose}},
          .step = step_options(options, {.damping_time = damping, .drag = drag}),
          .look = {.azimuth = 24, .elevation = 18, .still_time = 2.2},
          .watch = [stretch](const SceneState& state) { stretch->see(state); },
          .facts = [stretch](const SceneState&) { return stretch->facts(); }};
}

}  // namespace cape

const SceneEntry cape_scene{"cape", "a cape, pinned at the shoulders of who runs and stops", 4.2, cape::body,
                            cape::setup};

}  // namespace penalty::demo
