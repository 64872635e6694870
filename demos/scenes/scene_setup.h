// A scene before it enters a Bullet world: plain data.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "penalty/fields/elastic_field.h"
#include "penalty/fields/ledger.h"
#include "penalty/stepping/step_options.h"
#include "scenes/figure.h"
#include "scenes/rigid_object.h"
#include "scenes/scene_state.h"
#include "scenes/soft_object.h"

namespace penalty::demo {

/// From where it is drawn, and which moment makes the still.
struct Look {
  Real azimuth = 28, elevation = 14;    // [degrees]
  Real still_time = -1;                 // [s]; negative: the end
  bool wire = true;                     // the edges of the triangles, but for an embedded surface
  bool strain = false;                  // colours show strain, unless the user says otherwise
  std::optional<Real> color_high = {};  // top of the colours; empty: what most of the body reaches at some time
  /// The clip shows balls about the rest shapes, so many times as large; empty: all that moves.
  std::optional<Real> reach = {};
};

/// A body is put somewhere else, at rest.
struct Restart {
  Real time;         // [s]
  std::string name;  // what the picture says from then on
  Eigen::Matrix3Xd positions;
  std::size_t body = 0;
};

struct SceneSetup {
  std::string name;
  std::string title;  // of pictures
  std::vector<SoftObject> bodies = {};
  std::vector<Restart> restarts = {};  // in the course of the scene, in order
  Vector3 gravity = Vector3::Zero();   // [m/s²]
  bool ground = false;                 // a static box whose top is y = 0
  std::vector<RigidObject> objects = {};
  StepOptions step = {};  // of every body
  Look look = {};
  bool sleeps = false;  // at rest the world may stop stepping the bodies
  /// Called after each world step: what has to be seen as it happens. Empty: nothing has.
  std::function<void(const SceneState&)> watch = {};
  /// What the summary says of this scene alone, from its state at the end. Empty: nothing.
  std::function<std::vector<Fact>(const SceneState&)> facts = {};
};

/// A scene is stepped, or, if it has a `figure`, only drawn; then it has no body and no setup.
struct SceneEntry {
  std::string_view name, description;
  Real duration;  // of the run, or of the clip that goes round the figure, unless the user says otherwise [s]
  BodyMesh (*body)(const SceneOptions&);  // of which the soft ones are made; may take a second; whatever the seed
  SceneSetup (*setup)(const SceneOptions&, const BodyMesh&);
  std::vector<Figure> (*figures)(const SceneOptions&) = nullptr;
};

const std::vector<SceneEntry>& scenes();

/// Throws std::invalid_argument that names the scenes.
const SceneEntry& find_scene(std::string_view name);

// One file each.
extern const SceneEntry drop_scene, beam_scene, materials_scene, flight_scene, cloth_scene, fold_scene, balloon_scene,
    muscle_scene, plastic_scene, tear_scene, user_constraint_scene, collide_scene, stack_scene, bowl_scene, press_scene,
    incline_scene, bounce_scene, hand_scene, cape_scene, fork_scene, recover_scene, potential_field_scene;

/// The elastic part and the mass as the user wants them: one stiffness for all and 1 kg, or a material and a model of
/// it.
struct Elasticity {
  PotentialField field;
  Real mass;  // [kg]
};
Elasticity elasticity(const SceneOptions& options, const TetMesh& mesh, const Material& by_default,
                      ElasticModel default_model = ElasticModel::springs_volumes, int phases = 1);

/// A body of this mesh and material, or of what the user wants, at rest at `pose`; its start shape is the user's.
SoftObject soft_object(const SceneOptions& options, const BodyMesh& mesh, const Material& material, const Pose& pose);

/// `by_default` with what the user chose. Throws std::invalid_argument.
StepOptions step_options(const SceneOptions& options, StepOptions by_default);

}  // namespace penalty::demo
