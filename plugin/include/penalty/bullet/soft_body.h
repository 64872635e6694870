// Bullet soft bodies from tetrahedral meshes and from surfaces, and fields for those that are there.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/tet_mesh.h"
#include "penalty/mesh/triangle_surface.h"

class btSoftBody;
struct btSoftBodyWorldInfo;

namespace penalty {

struct SoftBodyOptions {
  std::optional<Real> mass = {};  // of the whole body [kg]; 1 kg, unless a material decides
  /// Else each node carries its share of the volume or area; equal ones allow larger substeps. Of several materials those
  /// within each are equal, on the whole.
  bool equal_masses = true;
  std::vector<int> pinned = {};  // nodes of zero inverse mass
  /// Collision margin [m]; unless said 2 cm, of what is smaller than a metre 2 % of its size, which is the longest side of
  /// the box around it.
  std::optional<Real> margin = {};
  Real friction = 0.5;  // Coulomb coefficient, multiplied with that of the other body
  /// For Bullet's own solver of the deformable world: its collision flags, and links along the edges, without which
  /// Bullet's trees are never finished. The plugin's solvers need neither.
  bool stock_deformable = false;
};

/// A Bullet soft body whose node i is vertex i of the mesh and whose faces are the boundary of the mesh. It holds no
/// tetrahedra of Bullet's, and links only on request: these cost time in every step, and the field replaces them.
/// `mesh.vertices` give the start positions. Throws std::invalid_argument that names the option, index and value.
std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const SoftBodyOptions& options = {});

/// Its mass is the density of the material times the volume of the mesh as it is now: make the body from the rest
/// shape, and move it then. `options.mass` is another answer to the same question, and refused. Stiffness is the
/// field's business.
std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const Material& material, const SoftBodyOptions& options = {});

/// The same of several materials: each node weighs by the density around it. Throws as `Materials::check`, too.
///
///     const TetMesh mesh = read_mesh("bar.msh");
///     const Material rubber{.young = 1e5}, cork{.young = 1e7, .density = 200};
///     const Materials materials = materials_of(mesh, {{"rubber", rubber}, {"cork", cork}});
///     auto body = make_soft_body(world_info, mesh, materials, {.pinned = mesh.vertex_set("clamped")});
///     solver.attach(*body, make_elastic_field(mesh.vertices, mesh.tetrahedra, materials));
std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const Materials& materials, const SoftBodyOptions& options = {});

/// The same from the triangles of a surface, open (cloth) or closed (a balloon): they become the faces, as they are.
std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TriangleSurface& surface,
                                           const SoftBodyOptions& options = {});

/// Its mass is the density of the material times area times `thickness` [m]; what a closed surface encloses weighs
/// nothing.
std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TriangleSurface& surface,
                                           const Material& material, Real thickness,
                                           const SoftBodyOptions& options = {});

struct BodyFieldOptions {
  ElasticModel model = ElasticModel::springs_volumes;  // of the tetrahedra
  /// Of what has faces but no tetrahedra [m]; unless said, so thick that density times volume is the mass of its nodes.
  std::optional<Real> thickness = {};
  Real bending = 1;  // see Sheet
  /// Cross section of what is made of links alone [m²]; unless said, by mass and density as well.
  std::optional<Real> section = {};
};

/// The field of a soft body as it is, whoever made it: Bullet's helpers, a file or the application. `attach` it, and the
/// body is of this material where its links were tuned by hand.
///
///     tetrahedra                                 elements of the model, see make_elastic_field
///     faces that are no side of a tetrahedron    a sheet, see make_sheet_field
///     links beside these                         springs of stiffness E A / L [N/m]
///
/// Positions of the nodes are the rest shape: take the field before the body is deformed. A link gives its edge its rest
/// length, and its m_kLST the share of the material's stiffness; that of an edge inside a solid does nothing. Links that
/// Bullet makes against bending (generateBendingConstraints) are left out where hinges stand for them, and so are faces
/// without an area. The mass stays what it is. Throws std::invalid_argument that names the body's node, link, face or
/// tetrahedron, or the number out of range.
PotentialField make_field(const btSoftBody& body, const Material& material, const BodyFieldOptions& options = {});

}  // namespace penalty
