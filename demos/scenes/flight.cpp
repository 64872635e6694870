// A stretched body spins and drifts; nothing acts on it. Momenta stay what they are, energy too.
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace flight {

constexpr Real stiffness = 0.1;      // of every constraint [J]
constexpr Real stretch = 1.2;        // along x
constexpr Real safety = 0.4;         // small substeps: the energy then swings by less than it is plotted with
constexpr Real hard_damping = 0.01;  // of a start far from rest, which otherwise would never find back [s]

BodyMesh body(const SceneOptions& options) { return load_body(options, "torus"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  SceneOptions chosen = options;
  if (!options.stiffness && !options.young && !options.poisson && !options.model) chosen.stiffness = stiffness;
  Elasticity elastic = elasticity(chosen, body.solid(), {});

  Eigen::Matrix3Xd positions = start_positions(body.vertices(), options.start.value_or(Start::rest), options.seed);
  Eigen::Matrix3Xd velocities = Eigen::Matrix3Xd::Zero(3, positions.cols());
  const bool hard = options.start.value_or(Start::rest) != Start::rest;
  if (!hard) {
    positions.row(0) *= stretch;
    const Vector3 drift(0.1, 0.06, 0), spin(1.2, 2.0, 0.6);  // [m/s], [rad/s]
    for (int i = 0; i < positions.cols(); ++i) velocities.col(i) = drift + spin.cross(Vector3(positions.col(i)));
  }
  return {.name = "flight",
          .title = "Free flight",
          .bodies = alone({.mesh = body,
                           .field = std::move(elastic.field),
                           .mass = elastic.mass,
                           .positions = positions,
                           .velocities = velocities}),
          .step = step_options(options, {.damping_time = hard ? hard_damping : 0, .safety = safety}),
          .look = {.azimuth = 20, .elevation = 32}};
}

}  // namespace flight

const SceneEntry flight_scene{"flight", "a stretched, spinning body flies freely", 10, flight::body, flight::setup};

}  // namespace penalty::demo
