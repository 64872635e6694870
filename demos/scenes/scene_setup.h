// A scene before it enters a Bullet world: plain data.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "penalty/assembly/potential_field.h"
#include "penalty/solvers/explicit_step.h"
#include "scenes/body_mesh.h"

namespace penalty::demo {

struct Ball {
  Vector3 position;  // [m]
  Real radius;       // [m]
  Real mass;         // [kg]
};

/// From where it is drawn, and which moment makes the still.
struct Look {
  Real azimuth = 28, elevation = 14;  // [degrees]
  Real still_time = -1;               // [s]; negative: the end
};

struct SceneSetup {
  std::string name;
  BodyMesh body;
  PotentialField field;
  Real mass = 1;                           // of the soft body, the same for every vertex [kg]
  Eigen::Matrix3Xd positions, velocities;  // at the start, 3 x vertices [m], [m/s]
  std::vector<int> pinned;                 // vertices that nothing moves
  Vector3 gravity = Vector3::Zero();       // [m/s²]
  bool ground = false;                     // a static box whose top is y = 0
  std::vector<Ball> balls;                 // rigid and free
  StepOptions step;
  std::vector<int> tip;  // vertices whose mean drop is followed
  Look look;
};

struct SceneEntry {
  std::string_view name, description;
  Real duration;                          // unless the user says otherwise [s]
  BodyMesh (*body)(const SceneOptions&);  // may take a second; does not depend on the seed
  SceneSetup (*setup)(const SceneOptions&, const BodyMesh&);
};

const std::vector<SceneEntry>& scenes();

/// Throws std::invalid_argument that names the scenes.
const SceneEntry& find_scene(std::string_view name);

// One file each.
BodyMesh drop_body(const SceneOptions& options);
SceneSetup drop(const SceneOptions& options, const BodyMesh& body);
BodyMesh beam_body(const SceneOptions& options);
SceneSetup beam(const SceneOptions& options, const BodyMesh& body);
BodyMesh flight_body(const SceneOptions& options);
SceneSetup flight(const SceneOptions& options, const BodyMesh& body);

/// The elastic part and the mass as the user wants them: one stiffness for all and 1 kg, or a material.
struct Elasticity {
  PotentialField field;
  Real mass;  // [kg]
};
Elasticity elasticity(const SceneOptions& options, const TetMesh& mesh, const Material& by_default);

/// `by_default` with what the user chose. Throws std::invalid_argument.
StepOptions step_options(const SceneOptions& options, StepOptions by_default);

}  // namespace penalty::demo
