#pragma once
#include <string>
#include <string_view>

#include "penalty/mesh/triangle_surface.h"

namespace penalty {

/// The vertices and faces of a PLY file, ASCII or binary, not yet repaired; polygons are cut into fans. Our own,
/// because Assimp reads beyond the end of a truncated one. Throws MeshError.
TriangleSurface read_ply(const std::string& file, std::string_view contents);

}  // namespace penalty
