// A simulation mesh around a surface: the lattice moves, the surface follows it.
#pragma once
#include <vector>

#include "penalty/mesh/tet_mesh.h"
#include "penalty/mesh/triangle_surface.h"

namespace penalty {

struct EmbeddingOptions {
  int cells = 20;  // along the longest side of the surface's bounding box, 1 to 200
};

/// Surface vertex v lies in the tetrahedron of the lattice vertices stencils[v], at the barycentric weights
/// weights.col(v): they add up to 1 and none is below -1e-9.
struct EmbeddedSurface {
  TetMesh lattice;
  TriangleSurface surface;
  std::vector<Tetrahedron> stencils;  // one a surface vertex
  Eigen::Matrix4Xd weights;           // 4 x surface vertices
  int pieces = 0;                     // of the lattice, joined by faces
};

/// Covers `surface`, repaired first, with the tetrahedra of a body-centred cubic lattice that touch it or lie inside:
/// all of one shape, edges 1 and sqrt(3)/2 cells, dihedral angles 60 and 90 degrees. What counts as inside is decided
/// by the winding number, so that cavities stay hollow where a cell fits, and any surface will do: with holes, which are
/// filled as by a membrane, with branching edges, in several pieces, which are one body then (see `pieces_of`). Of an open
/// sheet nothing is inside, and the lattice is one cell thick: it is better made cloth, `make_soft_body(surface)`. Lattice
/// vertices and tetrahedra are numbered slice by slice across the longest side of the box. Parts of the surface that come
/// closer than about a cell grow together: more cells separate them. Throws std::invalid_argument for a surface that
/// `repair` refuses, for one without extent and for cells out of range.
EmbeddedSurface embed(const TriangleSurface& surface, const EmbeddingOptions& options = {});

/// The surface vertices where the lattice takes them: column v = sum_k weights(k, v) x(stencils[v][k]).
/// `lattice_positions` is 3 x lattice vertices; the result 3 x surface vertices [m].
Eigen::Matrix3Xd skin(const EmbeddedSurface& embedded, const Eigen::Matrix3Xd& lattice_positions);

/// The same, overwriting `surface_positions`, which is resized if need be.
void skin(const EmbeddedSurface& embedded, const Eigen::Matrix3Xd& lattice_positions,
          Eigen::Matrix3Xd& surface_positions);

/// Surface vertices spread evenly, for contact points: no two are closer than `spacing` [m], and every surface vertex
/// is closer than `spacing` to one of them. Ascending indices. Throws std::invalid_argument unless spacing is positive
/// and finite.
std::vector<int> contact_samples(const EmbeddedSurface& embedded, Real spacing);

}  // namespace penalty
