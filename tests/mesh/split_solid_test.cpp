// Meshes of hexahedra, prisms and pyramids become tetrahedra that fit together.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <sstream>

#include "files.h"
#include "math/random.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

class SplitSolid : public MeshFiles {};

// A block of n^3 cells, each at random a hexahedron or six pyramids about a vertex of its own, with vertices that are off
// their places and numbered at random: a Gmsh file.
std::string mixed_block(int n, Random& random) {
  const int corners = (n + 1) * (n + 1) * (n + 1);
  const int places = corners + n * n * n;
  std::vector<int> number(static_cast<unsigned>(places));
  std::iota(number.begin(), number.end(), 1);
  for (std::size_t i = number.size() - 1; i > 0; --i)
    std::swap(number[i], number[random.index(static_cast<unsigned>(i + 1))]);
  std::ostringstream nodes, elements;
  nodes.precision(17);
  const auto at = [&](int i, int j, int k) {
    const int place = i + (n + 1) * (j + (n + 1) * k);
    return number[static_cast<std::size_t>(place)];
  };
  const auto off = [&](int i) { return i == 0 || i == n ? i : i + random.uniform(-0.2, 0.2); };
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) nodes << at(i, j, k) << " " << off(i) << " " << off(j) << " " << off(k) << "\n";
  int count = 0, used = corners;
  const auto element = [&](int type, std::initializer_list<int> vertices) {
    elements << ++count << " " << type << " 2 1 1";
    for (const int v : vertices) elements << " " << v;
    elements << "\n";
  };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int a = at(i, j, k), b = at(i + 1, j, k), c = at(i + 1, j + 1, k), d = at(i, j + 1, k);
        const int e = at(i, j, k + 1), f = at(i + 1, j, k + 1), g = at(i + 1, j + 1, k + 1), h = at(i, j + 1, k + 1);
        const Real kind = random.uniform(0, 3);
        if (kind < 1) {
          element(5, {a, b, c, d, e, f, g, h});
        } else if (kind < 2) {
          const int m = number[static_cast<std::size_t>(used++)];
          nodes << m << " " << i + 0.5 << " " << j + 0.5 << " " << k + 0.5 << "\n";
          element(7, {a, b, c, d, m});
          element(7, {e, f, g, h, m});
          element(7, {a, b, f, e, m});
          element(7, {b, c, g, f, m});
          element(7, {c, d, h, g, m});
          element(7, {d, a, e, h, m});
        } else {
          element(5, {f, b, c, g, e, a, d, h});  // the same, begun elsewhere
        }
      }
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(used) + "\n" + nodes.str() +
         "$EndNodes\n$Elements\n" + std::to_string(count) + "\n" + elements.str() + "$EndElements\n";
}

// Its outside, as far as two tetrahedra share each face within.
Real area_of_the_boundary(const TetMesh& mesh) {
  std::map<Triangle, int> sides;
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (int left_out = 0; left_out < 4; ++left_out) {
      Triangle face;
      for (int k = 0, at = 0; k < 4; ++k)
        if (k != left_out) face[at++] = t[k];
      std::sort(face.begin(), face.end());
      ++sides[face];
    }
  Real area = 0;
  for (const auto& [face, count] : sides) {
    EXPECT_LE(count, 2);
    const Vector3 a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]), c = mesh.vertices.col(face[2]);
    if (count == 1) area += (b - a).cross(c - a).norm() / 2;
  }
  return area;
}

TEST_F(SplitSolid, NeighboursCutTheFaceBetweenThemTheSameWay) {
  Random random(7);
  for (int run = 0; run < 20; ++run) {
    const int n = 1 + run % 4;
    const TetMesh mesh = read_mesh(write("a.msh", mixed_block(n, random)));
    EXPECT_NEAR(area_of_the_boundary(mesh), 6 * n * n, 1e-12 * n * n);
    Real filled = 0;  // more than the block where tetrahedra overlap
    for (const auto& [a, b, c, d] : mesh.tetrahedra) {
      const Vector3 o = mesh.vertices.col(a);
      filled += std::abs((mesh.vertices.col(b) - o)
                             .cross(Vector3(mesh.vertices.col(c) - o))
                             .dot(Vector3(mesh.vertices.col(d) - o))) /
                6;
    }
    EXPECT_NEAR(filled, n * n * n, 1e-12 * n * n * n);
  }
}

// Two prisms are a box, whichever corners come first; a hexahedron of which an edge is one corner twice is a prism.
TEST_F(SplitSolid, PrismsFillABox) {
  const std::string own = "1 6 0 1 2 3 5 6 7\n2 6 0 1 3 4 5 7 8\n";
  for (const std::string& elements : {own, std::string("1 6 0 6 7 5 2 3 1\n2 6 0 8 5 7 4 1 3\n"),
                                      std::string("1 5 0 1 2 3 3 5 6 7 7\n2 5 0 1 1 3 4 5 5 7 8\n")}) {
    SCOPED_TRACE(elements);
    const TetMesh mesh = read_mesh(write("a.msh", replaced(gmsh_prisms, own, elements)));
    EXPECT_EQ(mesh.tetrahedra.size(), 6u);
    EXPECT_NEAR(volume(mesh), 30, 1e-13);
    EXPECT_NEAR(area_of_the_boundary(mesh), 2 * (6 + 10 + 15), 1e-13);
  }
}

}  // namespace
}  // namespace penalty::testing
