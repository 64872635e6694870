// A bar that winds itself up. No list of kinds has the twist of a bar: it is written here, in a few lines.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "penalty/fields/batch_loops.h"
#include "penalty/kinds/user_constraint.h"
#include "penalty/mesh/builders.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace user_constraint {

constexpr Real length = 1.8, width = 0.3, ground_clearance = 0.1;  // [m]
constexpr int default_cells = 36;
constexpr Material rubber{.young = 1e5, .poisson = 0.35, .density = 300};
constexpr Real damping = 0.01;        // [s]
constexpr Real turns = 1, wound = 3;  // of the bar in the end, [s]

/// Of the whole bar: torque over the angle that is missing [J]. The bar itself has 0.14 mu width⁴ / length = 23 J: it
/// stays a hundredth short of what is wanted.
constexpr Real twist_stiffness = 2500;

/// The angle by which the rung p2 p3 is turned against the rung p0 p1, about the line between their middles:
///
///     p2 o-----o p3
///        |     |        C = atan2((a x b) . t, a . b) with a = p1 - p0, b = p3 - p2 and t the direction of that line
///     p0 o-----o p1
///
/// Written once, for numbers and for jets: the library differentiates it.
const auto twist = differentiated_constraint<4>([](const auto& p) {
  const auto a = (p.col(1) - p.col(0)).eval(), b = (p.col(3) - p.col(2)).eval();
  const auto along = (p.col(2) + p.col(3) - p.col(0) - p.col(1)).eval();
  return atan2(a.cross(b).dot(along) / along.norm(), a.dot(b));
});
using Twist = std::remove_const_t<decltype(twist)>;

/// Opposite vertices at the rim of each cross-section, joined to those above them. Vertices come section by section
/// from below, and in the opposite order those of a section lie opposite.
std::vector<std::array<int, 4>> ladder(const Eigen::Matrix3Xd& rest, int section) {
  std::vector<std::array<int, 4>> rungs;
  for (int first = 0; first + 2 * section <= static_cast<int>(rest.cols()); first += section)
    for (int k = 0; k < section / 2; ++k) {
      const int left = first + k, right = first + section - 1 - k;
      const bool at_rim = std::max(std::abs(rest(0, left)), std::abs(rest(2, left))) > width / 2 - 1e-9;
      if (at_rim) rungs.push_back({left, right, left + section, right + section});
    }
  return rungs;
}

/// Turns from one end to the other: the mean angle from section to section, times their number.
Real num_turns(const Positions& x, const PotentialField& field, Real num_sections) {
  const Batch<Twist>& rungs = *field.find<Twist>();
  const std::vector<Real> missing = strains(rungs, x);
  Real angle = 0;
  for (std::size_t e = 0; e < missing.size(); ++e) angle += missing[e] + rungs.target(static_cast<int>(e));
  return angle / static_cast<Real>(missing.size()) * num_sections / (2 * std::numbers::pi);
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "user_constraint");
  const int cells = cells_in(options, default_cells, 12, 120), across = cells / 6;
  TetMesh bar = make_box({width, length, width}, {across, cells, across});
  bar.vertices.colwise() += Vector3(-width / 2, ground_clearance, -width / 2);
  return {std::move(bar)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  Elasticity elastic = elasticity(options, body.solid(), rubber);
  const int across = cells_in(options, default_cells, 12, 120) / 6;
  const std::vector<std::array<int, 4>> rungs = ladder(rest, (across + 1) * (across + 1));
  // Sections in a row, rungs side by side: K of the bar = K of a rung * rungs in a section / sections.
  const auto sections = static_cast<Real>(rungs.size()) / (2 * across);
  elastic.field.add(twist, rungs, twist_stiffness * sections / (2 * across), "twist");

  std::vector<int> held;
  for (int i = 0; i < rest.cols(); ++i)
    if (rest(1, i) > ground_clearance + length - 1e-9) held.push_back(i);
  Eigen::Matrix3Xd positions = start_positions(rest, options.start.value_or(Start::rest), options.seed);
  for (int i : held) positions.col(i) = rest.col(i);
  return {.name = "user_constraint",
          .title = "A bar winds itself up",
          .bodies = alone({.mesh = body,
                           .field = std::move(elastic.field),
                           .mass = elastic.mass,
                           .positions = positions,
                           .pinned = held,
                           .control =
                               [sections](PotentialField& field, Real time) {
                                 const Real t = std::min(time / wound, 1.0), share = t * t * (3 - 2 * t);
                                 field.find("twist")->set_targets(share * 2 * std::numbers::pi * turns / sections);
                               }}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .step = step_options(options, {.damping_time = damping, .drag = 0.5}),
          .look = {.azimuth = 24, .elevation = 8},
          .facts = [sections](const SceneState& state) -> std::vector<Fact> {
            return {{"turns", num_turns(state.x(), state.field(), sections)}, {"wanted_turns", turns}};
          }};
}

}  // namespace user_constraint

const SceneEntry user_constraint_scene{"user_constraint",
                                       "a bar winds itself up: its constraint is a twist, written in the scene", 5,
                                       user_constraint::body, user_constraint::setup};

}  // namespace penalty::demo
