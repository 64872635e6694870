// A balloon on its nozzle, as light as air: its volume is one constraint over all its vertices, and blowing it up is
// moving the target.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "penalty/mesh/surface_builders.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace balloon {

constexpr Real radius = 0.4, clearance = 0.3;  // of the nozzle above the ground [m]
constexpr Fabric rubber{{.young = 4e4, .poisson = poisson_of_springs, .density = 1000}, {.thickness = 5e-4}};
constexpr Real damping = 0.004;  // [s]
/// Of the substeps: stretched by s, the skin has s² times the gradient of its rest shape; and the ledger is to hold.
constexpr Real safety = 0.15;

/// Of the volume [J]. The skin pulls it p V0 / K short of its target, where `skin_pressure` p is 29 Pa at 2.5 V0: half
/// a thousandth of the target. Stiffer would be worse: a target that moves between steps strikes the volume, and
/// damping, which acts eight times a step, does not see what swings through whole half periods in between.
constexpr Real volume_stiffness = 7000;

/// (V - V0) / V0 that is wanted.
Real wanted_volume(Real time) {
  constexpr Real in = 1.5, full = 2.5;  // [s]
  const Real t = std::min(time / full, 1.0);
  return in * t * t * (3 - 2 * t);
}

/// Pressure of a skin of springs that are all stretched alike: p dV = dE with E = 3/2 E h A0 (s - 1)², s = (V/V0)^1/3,
/// gives p = E h A0 (s - 1) / (V0 s²), of a sphere 3 E h (s - 1) / (R0 s²) [Pa].
Real skin_pressure(Real rest_area, Real rest_volume, Real volume) {
  const Real stretch = std::cbrt(volume / rest_volume);
  return rubber.tension_stiffness() * rest_area * (stretch - 1) / (rest_volume * stretch * stretch);
}

std::vector<Fact> facts(const Positions& x, const PotentialField& field, Real rest_area) {
  const Batch<EnclosedVolume>& batch = *field.find<EnclosedVolume>();
  const EnclosedVolume& kind = batch.kinds()[0];
  const Real volume = kind.signed_volume(x.topRows<3>()), rest = kind.rest_volume();
  const Real target = rest * (1 + batch.target(0)), strain = (volume - target) / rest;
  return {{"enclosed_volume", volume},
          {"target_volume", target},
          {"volume_gap", std::abs(volume / target - 1)},
          {"pressure", -batch.stiffness(0) * strain / rest},
          {"pressure_of_skin", skin_pressure(rest_area, rest, volume)}};
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "balloon");
  refuse_model(options, "balloon");
  TriangleSurface sphere = make_sphere(radius, cells_in(options, 28, 4, 200) / 2);  // of an icosahedron's edge
  sphere.vertices.row(1).array() += radius + clearance;
  return {std::move(sphere)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  if (options.poisson || options.young || options.stiffness)
    throw std::invalid_argument("scene balloon has a skin of its own: --young, --poisson and --stiffness do not apply");
  PotentialField field = rubber.field_of(body.shell());
  std::vector<int> everyone(static_cast<std::size_t>(body.vertices().cols()));
  std::iota(everyone.begin(), everyone.end(), 0);
  field.add(EnclosedVolume(body.shell().triangles), std::vector<std::vector<int>>{everyone}, volume_stiffness);

  Eigen::Index nozzle = 0;
  body.vertices().row(1).minCoeff(&nozzle);
  Eigen::Matrix3Xd positions = start_positions(body.vertices(), options.start.value_or(Start::rest), options.seed);
  positions.col(nozzle) = body.vertices().col(nozzle);
  return {
      .name = "balloon",
      .title = "A balloon is blown up",
      .bodies =
          alone({.mesh = body,
                 .field = std::move(field),
                 .mass = rubber.mass_of(body.shell()),
                 .positions = positions,
                 .pinned = {static_cast<int>(nozzle)},
                 .control = [](PotentialField& elements,
                               Real time) { elements.find<EnclosedVolume>()->set_targets(wanted_volume(time)); }}),
      .ground = true,
      .step = step_options(options, {.damping_time = damping, .drag = 0.3, .safety = safety, .contact_safety = safety}),
      .look = {.azimuth = 28, .elevation = 16},
      .facts = [rest_area = area(body.shell())](const SceneState& state) {
        return facts(state.x(), state.field(), rest_area);
      }};
}

}  // namespace balloon

const SceneEntry balloon_scene{"balloon", "a balloon is blown up until it encloses two and a half times its volume", 4,
                               balloon::body, balloon::setup};

}  // namespace penalty::demo
