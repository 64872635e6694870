// A worm of jelly: fibres along its belly contract one after another, and it crawls.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "penalty/mesh/builders.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace muscle {

constexpr Real length = 2, width = 0.3, height = 0.18;  // [m]
constexpr Real clearance = 0.02;                        // the margin of contact: it lies on the ground from the start
constexpr Material flesh{.young = 1e5, .poisson = 0.35, .density = 1000};
constexpr Real damping = 0.02;         // [s]
constexpr Real contact_safety = 0.35;  // half the usual: where the wave slides, the ledger needs it
constexpr Real fibre_young = 3e6;      // of the layer of cells at the belly, along the fibres [Pa]
constexpr Real contraction = 0.35;     // of a fibre's length, at most
constexpr Real wave_length = 1.1;      // [m]
constexpr Real period = 1, wakes = 5;  // [s]

/// How far a fibre at `x` is contracted: a wave that runs from tail to head.
Real wanted_strain(Real x, Real time) {
  const Real since = time - wakes;
  const Real onset = std::min(since / period, 1.0);
  const Real wave = std::sin(2 * std::numbers::pi * (since / period - x / wave_length));
  return -contraction * onset * (1 + wave) / 2;
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "muscle");
  const int cells = cells_in(options, 28, 8, 100), across = std::max(2, cells / 7);
  TetMesh bar = make_box({length, height, width}, {cells, across, across});
  bar.vertices.row(1).array() += clearance;
  return {std::move(bar)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  Elasticity elastic = elasticity(options, body.solid(), flesh);

  std::vector<Edge> fibres;
  const auto lies_at_belly = [&](int i) { return rest(1, i) < clearance + 1e-9; };
  for (const Edge& edge : body.edges()) {
    const Vector3 along = rest.col(edge[1]) - rest.col(edge[0]);
    if (lies_at_belly(edge[0]) && lies_at_belly(edge[1]) && along.tail<2>().norm() < 1e-9) fibres.push_back(edge);
  }
  // All fibres of a cross-section share the modulus times the area of a fifth of it: K = E A L0 / their number.
  const Real cells = std::round(length / (rest.col(fibres[0][1]) - rest.col(fibres[0][0])).norm());
  const Real fibre_area = width * height / 5 / (static_cast<Real>(fibres.size()) / cells);
  const Real stiffness = fibre_young * fibre_area * length / cells;
  elastic.field.add<Length>(fibres, stiffness, "muscle");

  const auto middles = std::make_shared<std::vector<Real>>();
  for (const auto& [a, b] : fibres) middles->push_back((rest(0, a) + rest(0, b)) / 2);

  const Eigen::Matrix3Xd positions = start_positions(rest, options.start.value_or(Start::rest), options.seed);
  const Real start = positions.row(0).mean();
  return {.name = "muscle",
          .title = "A worm crawls",
          .bodies = alone({.mesh = body,
                           .field = std::move(elastic.field),
                           .mass = elastic.mass,
                           .positions = positions,
                           .control =
                               [middles](PotentialField& field, Real time) {
                                 ElementBatch& muscle = *field.find("muscle");
                                 for (std::size_t e = 0; e < middles->size(); ++e)
                                   muscle.set_target(static_cast<int>(e), wanted_strain((*middles)[e], time));
                               },
                           .control_start = wakes}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .step = step_options(options, {.damping_time = damping, .contact_safety = contact_safety}),
          .look = {.azimuth = 24, .elevation = 14},
          .sleeps = true,
          .facts = [start](const SceneState& state) -> std::vector<Fact> {
            return {{"crawled", state.x().row(0).mean() - start}};
          }};
}

}  // namespace muscle

const SceneEntry muscle_scene{"muscle", "a worm wakes up and crawls: its fibres contract one after another", 12,
                              muscle::body, muscle::setup};

}  // namespace penalty::demo
