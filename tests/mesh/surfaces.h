// Closed surfaces to test with.
#pragma once
#include "penalty/mesh/builders.h"
#include "penalty/mesh/triangle_surface.h"

namespace penalty::testing {

/// The boundary of a tetrahedral mesh; its inner vertices stay, unmentioned.
inline TriangleSurface boundary_surface(const TetMesh& mesh) {
  return {mesh.vertices, boundary_faces(mesh.tetrahedra), "boundary of " + mesh.source, {}};
}

/// A triangle soup: three vertices of its own for each triangle, as in STL files.
inline TriangleSurface soup(const TriangleSurface& surface) {
  TriangleSurface apart{Eigen::Matrix3Xd(3, 3 * static_cast<Eigen::Index>(surface.triangles.size())), {}, "soup", {}};
  int next = 0;
  for (const Triangle& t : surface.triangles) {
    for (int v : t) apart.vertices.col(next++) = surface.vertices.col(v);
    apart.triangles.push_back({next - 3, next - 2, next - 1});
  }
  return apart;
}

inline TriangleSurface inside_out(TriangleSurface surface) {
  for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
  return surface;
}

/// Both surfaces in one.
inline TriangleSurface together(const TriangleSurface& a, const TriangleSurface& b) {
  TriangleSurface both{Eigen::Matrix3Xd(3, a.vertices.cols() + b.vertices.cols()), a.triangles, "two surfaces", {}};
  both.vertices << a.vertices, b.vertices;
  const int first = static_cast<int>(a.vertices.cols());
  for (const Triangle& t : b.triangles) both.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return both;
}

}  // namespace penalty::testing
