#include "scenes/shell.h"

namespace penalty::demo {

SceneCloth cloth_of(const SceneOptions& options, const BodyMesh& body, Fabric fabric) {
  if (!options.stiffness) {
    if (options.young) fabric.material.young = *options.young;
    if (options.poisson) fabric.material.poisson = *options.poisson;
    return {fabric.field_of(body.shell()), fabric.mass_of(body.shell())};
  }
  PotentialField springs(body.vertices());
  springs.add<Length>(body.edges(), *options.stiffness);
  return {std::move(springs), 1};
}

}  // namespace penalty::demo
