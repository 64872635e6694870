// Edges, faces, hinges and shares of meshes: what the batches are built from.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

using Edge = std::array<int, 2>;         // particle indices, lower first
using Triangle = std::array<int, 3>;     // counter-clockwise seen from outside
using Tetrahedron = std::array<int, 4>;  // (p1 - p0) . ((p2 - p0) x (p3 - p0)) > 0
using Hinge = std::array<int, 4>;        // see hinges_of

/// The edges of a tetrahedral mesh, each once, sorted by (lower, upper) index.
std::vector<Edge> edges_of(std::span<const Tetrahedron> tetrahedra);

/// The edges of a triangle mesh, each once, sorted by (lower, upper) index.
std::vector<Edge> edges_of(std::span<const Triangle> triangles);

/// The faces that belong to exactly one tetrahedron, oriented outwards if the tetrahedra are positively oriented,
/// in the order of their tetrahedra.
std::vector<Triangle> boundary_faces(std::span<const Tetrahedron> tetrahedra);

/// Every face of a tetrahedral mesh once, inner ones too, sorted by their indices, which ascend within a face.
std::vector<Triangle> faces_of(std::span<const Tetrahedron> tetrahedra);

/// Signed volume of each tetrahedron [m^3]. `vertices` is 3 x V [m].
std::vector<Real> signed_volumes(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra);

/// Exchanges two corners of those of negative volume, so that all have a positive one.
void orient(const Eigen::Matrix3Xd& vertices, std::span<Tetrahedron> tetrahedra);

/// v_e = sum of V_t / 6 over the tetrahedra t around edge e [m^3], one per edge of `edges_of(tetrahedra)`: the shares
/// of all edges add up to the volume of the mesh.
std::vector<Real> edge_volume_shares(std::span<const Edge> edges, std::span<const Tetrahedron> tetrahedra,
                                     std::span<const Real> volumes);

/// v_f = sum of V_t / 4 over the tetrahedra t on both sides of face f [m^3], one per face of `faces_of(tetrahedra)`:
/// the shares of all faces add up to the volume of the mesh.
std::vector<Real> face_volume_shares(std::span<const Triangle> faces, std::span<const Tetrahedron> tetrahedra,
                                     std::span<const Real> volumes);

/// The pairs of triangles that share an edge:
///
///              p1
///             /|\          edge p0 p1, the lower index first
///        p2  / | \  p3     wings p2 of the triangle on the left, (p0, p1, p2),
///            \ | /          and p3 of the one on the right, (p1, p0, p3)
///             \|/
///              p0
///
/// Each inner edge once, sorted by (p0, p1); edges of one triangle only, the rim of an open surface, have no hinge.
/// Throws std::invalid_argument that names the edge if it belongs to more than two triangles, or to two that run
/// through it in the same direction: there is no left and right then.
std::vector<Hinge> hinges_of(std::span<const Triangle> triangles);

/// Area of each triangle [m^2]. `vertices` is 3 x V [m].
std::vector<Real> areas_of(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles);

/// a_e = sum of A_t / 3 over the triangles t at edge e [m^2], one per edge of `edges_of(triangles)`: the shares of all
/// edges add up to the area of the surface.
std::vector<Real> edge_area_shares(std::span<const Edge> edges, std::span<const Triangle> triangles,
                                   std::span<const Real> areas);

}  // namespace penalty
