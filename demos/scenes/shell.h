// Thin sheets of the scenes: cloth, the skin of a balloon, foil.
#pragma once
#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/triangle_surface.h"
#include "scenes/body_mesh.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

constexpr Real poisson_of_springs = 1.0 / 3;  // in a plane

struct Fabric {
  Material material;
  Sheet sheet;

  Real tension_stiffness() const { return material.young * sheet.thickness; }  // E h [N/m]
  PotentialField field_of(const TriangleSurface& surface) const {
    return make_sheet_field(surface.vertices, surface.triangles, material, sheet);
  }
  Real mass_of(const TriangleSurface& surface) const {  // [kg]
    return material.density * sheet.thickness * area(surface);
  }
};

/// The cloth of a scene: of `fabric`, with what --young and --poisson say of it, or of bare springs where --stiffness is
/// given.
struct SceneCloth {
  PotentialField field;
  Real mass;  // [kg]
};
SceneCloth cloth_of(const SceneOptions& options, const BodyMesh& body, Fabric fabric);

}  // namespace penalty::demo
