#include "penalty/mesh/regions.h"

#include "mesh_text.h"

namespace penalty {
namespace {

std::string mesh_name(const TetMesh& mesh) { return mesh.source.empty() ? "mesh" : mesh.source; }

const std::vector<int>& members_of(const TetMesh& mesh, const std::vector<MeshGroup>& groups, const char* what,
                                   std::string_view name) {
  std::string there;
  for (const MeshGroup& group : groups) {
    if (group.name == name) return group.members;
    there.append(there.empty() ? "" : ", ").append(in_quotes(group.name));
  }
  throw std::invalid_argument(mesh_name(mesh) + ": there is no " + what + " " + in_quotes(name) +
                              (there.empty() ? ", nor any other" : "; there is " + there));
}

}  // namespace

const std::vector<int>& TetMesh::region(std::string_view name) const {
  return members_of(*this, regions, "region", name);
}

const std::vector<int>& TetMesh::vertex_set(std::string_view name) const {
  return members_of(*this, vertex_sets, "vertex set", name);
}

Materials materials_of(const TetMesh& mesh, const std::vector<RegionMaterial>& regions,
                       const std::optional<Material>& elsewhere) {
  constexpr int none = -1;
  Materials materials{.kinds = {}, .kind_of = std::vector<int>(mesh.tetrahedra.size(), none)};
  const auto fail = [&](int t, const std::string& text) {
    throw std::invalid_argument(mesh_name(mesh) + ": tetrahedron " + std::to_string(t) + " is " + text);
  };
  for (const auto& [name, material] : regions) {
    for (const int t : mesh.region(name)) {
      if (t < 0 || static_cast<std::size_t>(t) >= mesh.tetrahedra.size())
        fail(t, "outside the mesh, but in its region " + in_quotes(name));
      if (materials.kind_of[t] != none)
        fail(t, "in the region " + in_quotes(regions[materials.kind_of[t]].region) + " and in " + in_quotes(name));
      materials.kind_of[t] = static_cast<int>(materials.kinds.size());
    }
    materials.kinds.push_back(material);
  }
  for (std::size_t t = 0; t < materials.kind_of.size(); ++t)
    if (materials.kind_of[t] == none) {
      if (!elsewhere) fail(static_cast<int>(t), "in none of the regions named, and there is no material for elsewhere");
      materials.kind_of[t] = static_cast<int>(regions.size());
    }
  if (elsewhere) materials.kinds.push_back(*elsewhere);
  return materials;
}

}  // namespace penalty
