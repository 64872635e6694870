// A sheet with a notch, pulled apart at its lower corners: where its springs break, it rips.
#include <cmath>
#include <stdexcept>

#include "penalty/mesh/surface_builders.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"

namespace penalty::demo {
namespace tear {

constexpr Real width = 1.6, height = 1, ground_clearance = 0.25;  // [m]
constexpr Fabric foil{{.young = 1e6, .poisson = poisson_of_springs, .density = 500},
                      {.thickness = 1e-3, .bending = 0}};  // limp
constexpr Real damping = 0.003;                            // [s]
constexpr Real notch = 0.25;                               // of the height, from below
constexpr Real pull = 0.13;                                // speed of the lower corners; the upper ones stay [m/s]
constexpr Breaking strength{.upper = 0.15};
constexpr Real safety = 0.2;   // of the substeps: what breaks sends out the fastest waves, and the ledger is to hold
constexpr Real ripple = 2e-3;  // of the start, out of its plane: what is quite flat would stay so for ever [m]

/// Elements that were there, that are, and what left with those that broke.
std::vector<Fact> facts(const SceneState& state) {
  const Batch<Length>& springs = *state.field().find<Length>();
  int enabled = 0;
  for (int e = 0; e < static_cast<int>(springs.num_elements()); ++e) enabled += springs.is_enabled(e);
  double energy = 0;
  for (const Break& b : springs.breaks()) energy += b.energy;
  return {{"springs", static_cast<double>(springs.num_elements())},
          {"springs_enabled", static_cast<double>(enabled)},
          {"springs_broken", static_cast<double>(springs.breaks().size())},
          {"energy_of_broken_springs", energy}};
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "tear");
  refuse_model(options, "tear");
  const int cells = cells_in(options, 48, 8, 200), rows = std::max(4, 5 * cells / 8);
  TriangleSurface sheet = make_sheet(width, height, cells, rows);
  // The notch: one column of cells is missing, up to its tip. Two triangles a cell, row by row.
  std::vector<Triangle> left;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const int cell = static_cast<int>(t) / 2, column = cell % cells, row = cell / cells;
    if (column != cells / 2 || row >= notch * rows) left.push_back(sheet.triangles[t]);
  }
  sheet.triangles = std::move(left);
  sheet.vertices.colwise() += Vector3(-width / 2, ground_clearance, 0);
  return {std::move(sheet)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  if (options.start.value_or(Start::rest) != Start::rest)
    throw std::invalid_argument("scene tear starts at rest: from elsewhere it would break");
  if (options.poisson || options.young || options.stiffness)
    throw std::invalid_argument("scene tear has a sheet of its own: --young, --poisson and --stiffness do not apply");
  const Eigen::Matrix3Xd& rest = body.vertices();
  PotentialField field = foil.field_of(body.shell());
  field.find<Length>()->set_breaking(strength);

  // Both ends are moved: pinned, with a velocity. Everything between starts with its share of it, so that nothing
  // jerks.
  std::vector<int> ends;
  Eigen::Matrix3Xd positions = rest, velocities = Eigen::Matrix3Xd::Zero(3, rest.cols());
  for (int i = 0; i < rest.cols(); ++i) {
    const Real across = 2 * rest(0, i) / width;
    const Real below_top = 1 - (rest(1, i) - ground_clearance) / height;
    velocities(0, i) = pull * across * below_top;
    if (std::abs(across) > 1 - 1e-9)
      ends.push_back(i);
    else
      positions(2, i) += ripple * std::sin(5 * rest(0, i) + 7 * rest(1, i));
  }
  return {.name = "tear",
          .title = "A sheet rips",
          .bodies = alone({.mesh = body,
                           .field = std::move(field),
                           .mass = foil.mass_of(body.shell()),
                           .positions = positions,
                           .velocities = velocities,
                           .pinned = ends}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .step = step_options(options, {.damping_time = damping, .safety = safety, .contact_safety = safety}),
          .look = {.azimuth = 18, .elevation = 10, .still_time = 0.78},
          .facts = facts};
}

}  // namespace tear

const SceneEntry tear_scene{"tear", "a notched sheet is pulled apart and rips", 2, tear::body, tear::setup};

}  // namespace penalty::demo
