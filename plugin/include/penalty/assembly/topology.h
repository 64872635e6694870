// Edges, faces and shares of a tetrahedral mesh: what the batches are built from.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

using Edge = std::array<int, 2>;         // particle indices, lower first
using Triangle = std::array<int, 3>;     // counter-clockwise seen from outside
using Tetrahedron = std::array<int, 4>;  // (p1 - p0) . ((p2 - p0) x (p3 - p0)) > 0

/// The edges of a tetrahedral mesh, each once, sorted by (lower, upper) index.
std::vector<Edge> edges_of(std::span<const Tetrahedron> tetrahedra);

/// The edges of a triangle mesh, each once, sorted by (lower, upper) index.
std::vector<Edge> edges_of(std::span<const Triangle> triangles);

/// The faces that belong to exactly one tetrahedron, oriented outwards if the tetrahedra are positively oriented,
/// in the order of their tetrahedra.
std::vector<Triangle> boundary_faces(std::span<const Tetrahedron> tetrahedra);

/// Signed volume of each tetrahedron [m^3]. `vertices` is 3 x V [m].
std::vector<Real> signed_volumes(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra);

/// v_e = sum of V_t / 6 over the tetrahedra t around edge e [m^3], one per edge of `edges_of(tetrahedra)`: the shares of
/// all edges add up to the volume of the mesh.
std::vector<Real> edge_volume_shares(std::span<const Edge> edges, std::span<const Tetrahedron> tetrahedra,
                                     std::span<const Real> volumes);

}  // namespace penalty
