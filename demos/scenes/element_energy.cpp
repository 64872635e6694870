#include "scenes/element_energy.h"

#include <algorithm>
#include <set>

namespace penalty::demo {
std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field) {
  std::set<Edge> broken;
  for (const auto& potential : field.potentials())
    if (const auto* batch = dynamic_cast<const Batch<Length>*>(potential.get()))
      for (const Break& b : batch->breaks())
        if (!batch->is_enabled(b.element)) broken.insert(batch->stencils()[b.element]);
  if (broken.empty() || body.surface) return {};
  const auto has_broken_edge = [&broken](const auto& element) {
    for (std::size_t i = 0; i < element.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (broken.contains({std::min(element[i], element[j]), std::max(element[i], element[j])})) return true;
    return false;
  };
  if (body.is_shell()) {
    std::vector<Triangle> triangles = body.shell().triangles;
    std::erase_if(triangles, has_broken_edge);
    return triangles;
  }
  std::vector<Tetrahedron> tetrahedra = body.solid().tetrahedra;
  std::erase_if(tetrahedra, has_broken_edge);
  return boundary_faces(tetrahedra);
}

}  // namespace penalty::demo
