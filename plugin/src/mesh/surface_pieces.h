// What hangs together in a surface.
#pragma once
#include "penalty/mesh/triangle_surface.h"

namespace penalty {

/// Pieces of the surface that are joined by vertices.
int count_pieces(const TriangleSurface& surface);

}  // namespace penalty
