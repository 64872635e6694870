#include <stdexcept>

#include "penalty/fields/elastic_field.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {

const std::vector<SceneEntry>& scenes() {
  static const std::vector<SceneEntry> list{
      drop_scene,    beam_scene,   materials_scene, flight_scene,         cloth_scene,           fold_scene,
      balloon_scene, muscle_scene, plastic_scene,   tear_scene,           user_constraint_scene, collide_scene,
      stack_scene,   bowl_scene,   press_scene,     incline_scene,        bounce_scene,          hand_scene,
      cape_scene,    fork_scene,   recover_scene,   potential_field_scene};
  return list;
}

const SceneEntry& find_scene(std::string_view name) {
  std::string choices;
  for (const SceneEntry& scene : scenes()) {
    if (scene.name == name) return scene;
    choices += (choices.empty() ? "" : ", ") + std::string(scene.name);
  }
  throw std::invalid_argument("unknown scene \"" + std::string(name) + "\", must be one of " + choices);
}

namespace {

PotentialField elastic(const TetMesh& mesh, const Material& material, ElasticModel model) {
  return make_elastic_field(mesh.vertices, mesh.tetrahedra, material, model);
}

PotentialField recovering(const TetMesh& mesh, const Material& material, ElasticModel model) {
  return make_recovering_field(mesh.vertices, mesh.tetrahedra, material, model);
}

}  // namespace

Elasticity elasticity(const SceneOptions& options, const TetMesh& mesh, const Material& by_default,
                      ElasticModel default_model, int phases) {
  if (options.stiffness) return {make_elastic_field(mesh.vertices, mesh.tetrahedra, *options.stiffness), 1};
  Material material = by_default;
  if (options.young) material.young = *options.young;
  if (options.poisson) material.poisson = *options.poisson;
  const ElasticModel model = options.model.value_or(default_model);
  material.check(model);
  const auto make = options.phases.value_or(phases) == 2 ? &recovering : &elastic;
  return {make(mesh, material, model), material.density * volume(mesh)};
}

SoftObject soft_object(const SceneOptions& options, const BodyMesh& mesh, const Material& material, const Pose& pose) {
  Elasticity elastic = elasticity(options, mesh.solid(), material);
  const Eigen::Matrix3Xd start = start_positions(mesh.vertices(), options.start.value_or(Start::rest), options.seed);
  return {.mesh = mesh,
          .field = std::move(elastic.field),
          .mass = elastic.mass,
          .positions = (pose.rotation * start).colwise() + pose.position};
}

StepOptions step_options(const SceneOptions& options, StepOptions by_default) {
  if (options.damping) by_default.damping_time = *options.damping;
  if (options.drag) by_default.drag = *options.drag;
  if (options.integrator) by_default.integrator = *options.integrator;
  if (options.order) by_default.implicit_order = *options.order;
  if (options.substeps) by_default.substeps = *options.substeps;
  by_default.check();
  return by_default;
}

}  // namespace penalty::demo
