// A hardness test: a ball is pressed into a block of metal and withdrawn. The springs flow beyond their yield strain.
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "penalty/mesh/builders.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace plastic {

constexpr Real width = 0.8, height = 0.3, clearance = 0.02;  // of the block, of its bottom above the ground [m]
constexpr Material metal{.young = 2e6, .poisson = 0.3, .density = 2000};
constexpr Plasticity flow{.yield = 0.02, .creep = infinite, .limit = 0.6};
constexpr Real damping = 0.004;                             // [s]
constexpr Real ball_radius = 0.22, margin = 0.02;           // [m]
constexpr Real depth = 0.1, pressing = 1.2, withdrawn = 2;  // of the press [m], [s]

/// Height of the ball's lowest point above the block's rest shape.
Real ball_height(Real time) {
  const Real start = 0.05 + margin, end = margin - depth;
  const auto smooth = [](Real t) { return t * t * (3 - 2 * t); };
  if (time < pressing) return start + (end - start) * smooth(time / pressing);
  return end + (2 * start - end) * smooth(std::min((time - pressing) / (withdrawn - pressing), 1.0));
}

/// What the yield law makes of the strains that were seen: the elastic part of a strain C never exceeds the yield
/// strain, and the plastic part p moves only as far as that asks for, p' = C - clamp(C - p, -yield, yield).
struct YieldLaw {
  std::vector<Real> plastic;

  void see(const Positions& x, const Batch<Length>& springs) {
    plastic.resize(springs.num_elements(), 0);
    const std::vector<Real> strains = penalty::strains(springs, x);  // elastic ones
    for (std::size_t e = 0; e < plastic.size(); ++e) {
      const Real total = strains[e] + springs.plastic_strain(static_cast<int>(e));
      plastic[e] = std::clamp(total - std::clamp(total - plastic[e], -flow.yield, flow.yield), -flow.limit, flow.limit);
    }
  }
};

/// The highest layer of vertices: how deep its lowest one lies below its rim, and the deepest that the ball was in.
std::vector<Fact> facts(const Positions& x, const PotentialField& field, const YieldLaw& law) {
  const Batch<Length>& springs = *field.find<Length>();
  const PackedVectors& rest = field.rest_positions();
  const Real low = rest.row(0).minCoeff(), high = rest.row(0).maxCoeff();
  Real lowest = infinite, rim = 0;
  int num_rim = 0;
  for (int i = 0; i < rest.cols(); ++i) {
    if (rest(1, i) < clearance + height - 1e-9) continue;
    lowest = std::min(lowest, x(1, i));
    if (rest(0, i) > low + 1e-9 && rest(0, i) < high - 1e-9) continue;
    rim += x(1, i);
    ++num_rim;
  }
  const std::vector<Real> elastic = strains(springs, x);
  Real mean = 0, largest = 0, error = 0, largest_elastic = 0;
  for (std::size_t e = 0; e < law.plastic.size(); ++e) {
    const Real plastic = springs.plastic_strain(static_cast<int>(e));
    mean += std::abs(plastic) / static_cast<Real>(law.plastic.size());
    largest = std::max(largest, std::abs(plastic));
    error = std::max(error, std::abs(plastic - law.plastic[e]));
    largest_elastic = std::max(largest_elastic, std::abs(elastic[e]));
  }
  return {{"dent", rim / num_rim - lowest},
          {"press_depth", depth},
          {"plastic_strain_mean", mean},
          {"plastic_strain_max", largest},
          {"elastic_strain_max", largest_elastic},
          {"yield_strain", flow.yield},
          {"yield_law_error", error}};
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "plastic");
  refuse_model(options, "plastic");
  if (options.phases.value_or(1) != 1)
    throw std::invalid_argument("scene plastic is about springs that flow: --phases 2 does not apply");
  const int cells = cells_in(options, 20, 4, 60), upright = std::max(2, 3 * cells / 8);
  TetMesh block = make_box({width, height, width}, {cells, upright, cells});
  block.vertices.colwise() += Vector3(-width / 2, clearance, -width / 2);
  return {std::move(block)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  if (options.start.value_or(Start::rest) != Start::rest)
    throw std::invalid_argument("scene plastic starts at rest: from elsewhere it would flow at once");
  Elasticity elastic = elasticity(options, body.solid(), metal);
  elastic.field.find<Length>()->set_plasticity(flow);
  const auto law = std::make_shared<YieldLaw>();
  return {.name = "plastic",
          .title = "A dent that stays",
          .bodies = alone(
              {.mesh = body, .field = std::move(elastic.field), .mass = elastic.mass, .positions = body.vertices()}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .objects = {{.shape = Ball{ball_radius},
                       .path =
                           [](Real time) {
                             return Pose{.position = {0, clearance + height + ball_radius + ball_height(time), 0}};
                           }}},
          .step = step_options(options, {.damping_time = damping}),
          .look = {.azimuth = 28, .elevation = 30},
          .watch = [law](const SceneState& state) { law->see(state.x(), *state.field().find<Length>()); },
          .facts = [law](const SceneState& state) { return facts(state.x(), state.field(), *law); }};
}

}  // namespace plastic

const SceneEntry plastic_scene{"plastic", "a ball is pressed into a block of metal and withdrawn: the dent stays", 2.5,
                               plastic::body, plastic::setup};

}  // namespace penalty::demo
