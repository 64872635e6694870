#include <stdexcept>

#include "scenes/scene_setup.h"

namespace penalty::demo {

const std::vector<SceneEntry>& scenes() {
  static const std::vector<SceneEntry> list{
      {"drop", "a mesh, by default the Stanford bunny, falls on the ground among rigid balls", 3, drop_body, drop},
      {"beam", "a beam of 4 x 1 x 1 m, held at one end, bends under its weight", 2, beam_body, beam},
      {"flight", "a stretched, spinning body flies freely", 10, flight_body, flight}};
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

Elasticity elasticity(const SceneOptions& options, const TetMesh& mesh, const Material& by_default) {
  if (options.stiffness) return {make_elastic_field(mesh.vertices, mesh.tetrahedra, *options.stiffness), 1};
  Material material = by_default;
  if (options.young) material.young = *options.young;
  if (options.poisson) material.poisson = *options.poisson;
  material.check();
  return {make_elastic_field(mesh.vertices, mesh.tetrahedra, material), material.density * volume(mesh)};
}

StepOptions step_options(const SceneOptions& options, StepOptions by_default) {
  if (options.damping) by_default.damping_time = *options.damping;
  if (options.drag) by_default.drag = *options.drag;
  if (options.substeps) by_default.substeps = *options.substeps;
  by_default.check();
  return by_default;
}

}  // namespace penalty::demo
