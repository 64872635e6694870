// Thin sheets from springs and hinges: cloth, the skin of a balloon, foil.
#pragma once
#include <string_view>

#include "penalty/fields/potential_field.h"
#include "penalty/mesh/triangle_surface.h"
#include "scenes/body_mesh.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

/// A sheet of an isotropic material; Poisson's ratio is that of springs in a plane, 1/3.
struct Sheet {
  Real young = 1e6;       // E [Pa]
  Real thickness = 1e-3;  // h [m]
  Real density = 1000;    // [kg/m³]
  Real bending = 1;       // flexural rigidity over that of a plate of this thickness; woven cloth is below 1

  Real tension_stiffness() const { return young * thickness; }                                             // E h [N/m]
  Real flexural_rigidity() const { return bending * young * thickness * thickness * thickness * 3 / 32; }  // D [N m]
};

/// Springs on the edges and hinges across them, as stiff on a fine mesh as on a coarse one:
///
///     K_length = 3 E h a_e                 a_e the part of the rest area that the edge stands for
///     K_hinge  = D |e|² / (A_1 + A_2)      the triangles on both sides of the edge e
///
/// Springs with K = Y a_e, averaged over directions in their plane, have the plane Lamé parameters mu = lambda = Y/8
/// [N/m], hence E h = Y/3 and Poisson's ratio 1/3. The hinges' weights are those of Grinspun et al. 2003 (Discrete
/// Shells) and Bridson et al. 2003; bent to a cylinder of curvature c, a mesh of equal triangles, rectangular or
/// equilateral, holds D c²/2 per area, as a plate with D = E h³ / 12 (1 - 1/9) does.
PotentialField shell_field(const TriangleSurface& surface, const Sheet& sheet);

/// The cloth of a scene: of `sheet`, with what --young says of it, or of bare springs where --stiffness is given. Throws
/// std::invalid_argument for --poisson.
struct SceneCloth {
  PotentialField field;
  Real mass;  // [kg]
};
SceneCloth cloth_of(std::string_view scene, const SceneOptions& options, const BodyMesh& body, Sheet sheet);

}  // namespace penalty::demo
