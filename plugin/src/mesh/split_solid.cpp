#include "split_solid.h"

#include <algorithm>
#include <array>

namespace penalty {
namespace {

using Face = std::array<int, 4>;  // corners going round; a triangle ends with -1

constexpr std::array<Face, 5> faces_of_pyramid{
    {{0, 1, 2, 3}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}}};
constexpr std::array<Face, 5> faces_of_prism{{{0, 1, 2, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
constexpr std::array<Face, 6> faces_of_hexahedron{
    {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};

std::span<const Face> faces_of(Solid solid) {
  switch (solid) {
    case Solid::pyramid:
      return faces_of_pyramid;
    case Solid::prism:
      return faces_of_prism;
    case Solid::hexahedron:
      return faces_of_hexahedron;
    case Solid::tetrahedron:
      break;
  }
  return {};
}

// Four corners of its own.
bool is_whole(const Tetrahedron& t) {
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b)
      if (t[a] == t[b]) return false;
  return true;
}

}  // namespace

void split(Solid solid, std::span<const int> corners, const Eigen::Matrix3Xd& vertices,
           std::vector<Tetrahedron>& tetrahedra) {
  const std::size_t first = tetrahedra.size();
  const int apex = *std::min_element(corners.begin(), corners.end());
  const auto join = [&](int a, int b, int c) {
    const Tetrahedron t{apex, a, b, c};
    if (is_whole(t)) tetrahedra.push_back(t);
  };
  for (const Face& face : faces_of(solid)) {
    std::array<int, 4> around{-1, -1, -1, -1};
    const int size = face[3] < 0 ? 3 : 4;
    for (int k = 0; k < size; ++k) around[k] = corners[face[k]];
    if (std::find(around.begin(), around.end(), apex) != around.end()) continue;
    if (size == 4) {
      std::rotate(around.begin(), std::min_element(around.begin(), around.end()), around.end());
      join(around[0], around[2], around[3]);
    }
    join(around[0], around[1], around[2]);
  }
  orient(vertices, std::span(tetrahedra).subspan(first));
}

}  // namespace penalty
