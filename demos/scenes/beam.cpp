// The reference beam: 4 x 1 x 1 m, E = 10 MPa, 1000 kg/m³, held at x = 0, in gravity from t = 0 on.
#include <cmath>
#include <stdexcept>

#include "penalty/mesh/builders.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace beam {

constexpr Real young = 1e7, density = 1000, drag = 0.1;

/// Springs of k = 0.4 E h on the edges, h the side of a cell, and E / V0 on the volumes: K_L = 0.4 E h L0² and K_V = E
/// V0.
PotentialField reference_field(const TetMesh& mesh, Real cell) {
  PotentialField field(mesh.vertices);
  const std::vector<Edge> edges = edges_of(mesh.tetrahedra);
  std::vector<Real> stiffnesses;
  stiffnesses.reserve(edges.size());
  for (const auto& [a, b] : edges)
    stiffnesses.push_back(0.4 * young * cell * (mesh.vertices.col(b) - mesh.vertices.col(a)).squaredNorm());
  field.add<Length>(edges, stiffnesses);
  stiffnesses.clear();
  for (Real volume : signed_volumes(mesh.vertices, mesh.tetrahedra)) stiffnesses.push_back(young * volume);
  field.add<TetrahedronVolume>(mesh.tetrahedra, stiffnesses);
  return field;
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "beam");
  const int cells = options.cells.value_or(32);
  if (cells < 4 || cells > 200 || cells % 4 != 0)
    throw std::invalid_argument("--cells is " + std::to_string(cells) +
                                ", must be a multiple of 4 from 4 to 200 for the beam");
  return {make_beam(cells / 4)};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd& rest = body.vertices();
  const bool reference = !options.stiffness && !options.young && !options.poisson && !options.model;
  const Real cell = 4.0 / options.cells.value_or(32);
  Elasticity elastic = reference
                           ? Elasticity{reference_field(body.solid(), cell), density * volume(body.solid())}
                           : elasticity(options, body.solid(), {.young = young, .poisson = 0.3, .density = density});

  std::vector<int> pinned, tip;
  const Real length = rest.row(0).maxCoeff();
  for (int i = 0; i < rest.cols(); ++i) {
    if (rest(0, i) < 1e-9 * length) pinned.push_back(i);
    if (rest(0, i) > (1 - 1e-9) * length) tip.push_back(i);
  }
  Eigen::Matrix3Xd positions = start_positions(rest, options.start.value_or(Start::rest), options.seed);
  for (int i : pinned) positions.col(i) = rest.col(i);

  return {.name = "beam",
          .title = "Clamped beam",
          .bodies = alone({.mesh = body,
                           .field = std::move(elastic.field),
                           .mass = elastic.mass,
                           .positions = positions,
                           .pinned = pinned,
                           .tip = tip}),
          .gravity = {0, -9.81, 0},
          .step = step_options(options, {.drag = drag}),
          .look = {.azimuth = 24, .elevation = 12, .still_time = 0.5}};  // when it hangs deepest
}

}  // namespace beam

const SceneEntry beam_scene{"beam", "a beam of 4 x 1 x 1 m, held at one end, bends under its weight", 2, beam::body,
                            beam::setup};

}  // namespace penalty::demo
