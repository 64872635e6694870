// Materials of the regions of a mesh.
#pragma once
#include <optional>

#include "penalty/energy/material.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty {

struct RegionMaterial {
  std::string region;
  Material material;
};

/// What each tetrahedron of `mesh` is made of: the material of its region, or of none of these `elsewhere`.
///
///     const Material rubber{.young = 1e5}, cork{.young = 1e7, .density = 200};
///     const Materials materials = materials_of(mesh, {{"rubber", rubber}, {"cork", cork}});
///
/// Regions that are not named here do not count. Throws std::invalid_argument for a region that the mesh does not have,
/// with those that it has; for a tetrahedron that is in two of the regions named, or in none without `elsewhere`.
Materials materials_of(const TetMesh& mesh, const std::vector<RegionMaterial>& regions,
                       const std::optional<Material>& elsewhere = {});

}  // namespace penalty
