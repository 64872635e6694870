// Reads triangle surfaces. Its own library, BulletPenalty::surface: nothing else needs Assimp.
#pragma once
#include <filesystem>

#include "penalty/mesh/tet_mesh.h"
#include "penalty/mesh/triangle_surface.h"

namespace penalty {

/// True for the names that `read_surface` takes: .obj, .stl, .ply in any case. Does not open the file.
bool is_surface_file(const std::filesystem::path& path);

/// Reads all faces of an .obj or .stl file (through Assimp, in single precision) or of a .ply file and repairs them;
/// larger polygons are cut into fans. Open surfaces are cloth to `make_soft_body`; `check_closed` refuses them where that
/// matters, and `embed` takes all. Throws MeshError with one line, naming the file, for everything that is wrong
/// with it.
TriangleSurface read_surface(const std::filesystem::path& path);

}  // namespace penalty
