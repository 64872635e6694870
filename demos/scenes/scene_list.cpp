#include <stdexcept>

#include "penalty/assembly/two_phase.h"
#include "scenes/scene_setup.h"

namespace penalty::demo {

const std::vector<SceneEntry>& scenes() {
  static const std::vector<SceneEntry> list{
      {"drop", "a mesh, by default the Stanford bunny, falls on the ground among rigid balls", 3, drop_body, drop},
      {"beam", "a beam of 4 x 1 x 1 m, held at one end, bends under its weight", 2, beam_body, beam},
      {"flight", "a stretched, spinning body flies freely", 10, flight_body, flight},
      {"cloth", "a sheet, held at its corners, catches a ball", 4, cloth_body, cloth},
      {"balloon", "a balloon is blown up until it encloses two and a half times its volume", 4, balloon_body, balloon},
      {"muscle", "a worm wakes up and crawls: its fibres contract one after another", 12, muscle_body, muscle},
      {"plastic", "a ball is pressed into a block of metal and withdrawn: the dent stays", 2.5, plastic_body, plastic},
      {"tear", "a notched sheet is pulled apart and rips", 2, tear_body, tear},
      {"user_constraint", "a bar winds itself up: its constraint is a twist, written in the scene", 5,
       user_constraint_body, user_constraint},
      {"recover", "a body finds back to its rest shape: squashed, flattened, mirrored, scrambled", 16, recover_body, recover},
      {"potential_field", "a figure: equipotential surfaces of one particle, and the forces of a volume", 6, nullptr,
       nullptr, potential_field}};
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

StepOptions step_options(const SceneOptions& options, StepOptions by_default) {
  if (options.damping) by_default.damping_time = *options.damping;
  if (options.drag) by_default.drag = *options.drag;
  if (options.integrator) by_default.integrator = *options.integrator;
  if (options.substeps) by_default.substeps = *options.substeps;
  by_default.check();
  return by_default;
}

}  // namespace penalty::demo
