#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "penalty/mesh/tet_mesh.h"

namespace penalty {
namespace {

// Edge (a, b) and the two vertices opposite it.
constexpr int hinges[6][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};

}  // namespace

MeshQuality quality(const TetMesh& mesh) {
  MeshQuality worst{0, std::numbers::pi, 0};
  for (const Tetrahedron& t : mesh.tetrahedra) {
    Points<4> p;
    for (int k = 0; k < 4; ++k) p.col(k) = mesh.vertices.col(t[k]);
    Real longest = 0, shortest = std::numeric_limits<Real>::infinity();
    for (const auto& [a, b, c, d] : hinges) {
      const Vector3 edge = p.col(b) - p.col(a);
      longest = std::max(longest, edge.norm());
      shortest = std::min(shortest, edge.norm());
      const Vector3 m = edge.cross(p.col(c) - p.col(a)), n = edge.cross(p.col(d) - p.col(a));
      const Real angle = std::atan2(m.cross(n).norm(), m.dot(n));
      worst.smallest_dihedral = std::min(worst.smallest_dihedral, angle);
      worst.largest_dihedral = std::max(worst.largest_dihedral, angle);
    }
    worst.edge_ratio = std::max(worst.edge_ratio, longest / shortest);
  }
  return worst;
}

}  // namespace penalty
