#include "scenes/element_energy.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace penalty::demo {
namespace {

template <class Visit>
void for_each_length_batch(const PotentialField& field, const Visit& visit) {
  for (const auto& potential : field.potentials()) {
    if (const auto* nested = dynamic_cast<const PotentialField*>(potential.get()))
      for_each_length_batch(*nested, visit);
    if (const auto* batch = dynamic_cast<const Batch<Length>*>(potential.get())) visit(*batch);
  }
}

}  // namespace

Eigen::VectorXd particle_energies(const PotentialField& field, const Positions& x) {
  Eigen::VectorXd energies = Eigen::VectorXd::Zero(field.num_particles());
  field.add_particle_energies(x, {energies.data(), static_cast<std::size_t>(energies.size())});
  return energies;
}

std::vector<Triangle> unbroken_triangles(const BodyMesh& body, const PotentialField& field) {
  std::set<Edge> broken;
  for_each_length_batch(field, [&](const Batch<Length>& batch) {
    for (const Break& b : batch.breaks())
      if (!batch.is_enabled(b.element)) broken.insert(batch.stencils()[b.element]);
  });
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
