#include "scenes/unbroken_triangles.h"

#include "penalty/fields/broken_elements.h"

namespace penalty::demo {

std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field) {
  const BrokenElements broken(field);
  if (broken.empty() || body.surface) return {};
  const auto is_cut = [&broken](const auto& element) { return broken.cut(element); };
  if (body.is_shell()) {
    std::vector<Triangle> triangles = body.shell().triangles;
    std::erase_if(triangles, is_cut);
    return triangles;
  }
  std::vector<Tetrahedron> tetrahedra = body.solid().tetrahedra;
  std::erase_if(tetrahedra, is_cut);
  return boundary_faces(tetrahedra);
}

}  // namespace penalty::demo
