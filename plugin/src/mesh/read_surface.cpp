#include "penalty/mesh/read_surface.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "mesh_text.h"
#include "penalty/mesh/tet_mesh.h"
#include "read_ply.h"

namespace penalty {
namespace {

TriangleSurface copy_triangles(const aiScene& scene) {
  TriangleSurface surface;
  std::vector<Vector3> vertices;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    const int first = static_cast<int>(vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      vertices.emplace_back(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z);
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      for (unsigned k = 2; k < face.mNumIndices; ++k)  // a fan; points and lines have none
        surface.triangles.push_back({first + static_cast<int>(face.mIndices[0]),
                                     first + static_cast<int>(face.mIndices[k - 1]),
                                     first + static_cast<int>(face.mIndices[k])});
    }
  }
  surface.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v) surface.vertices.col(static_cast<Eigen::Index>(v)) = vertices[v];
  return surface;
}

TriangleSurface read_through_assimp(const std::string& name, const std::string& contents,
                                    const std::string& extension) {
  // Assimp's messages may end with all that is left of the file.
  const auto first_line = [](std::string_view text) {
    return printable(text.substr(0, text.find_first_of("\r\n")), 200);
  };
  Assimp::Importer importer;  // its log goes nowhere unless a program creates one
  const aiScene* scene = nullptr;
  try {
    // Without post-processing: Debian's Assimp keeps its assertions, and its steps abort on some broken files.
    scene = importer.ReadFileFromMemory(contents.data(), contents.size(), 0, extension.substr(1).c_str());
  } catch (const std::exception& error) {
    throw MeshError(name + ": " + first_line(error.what()));
  }
  if (!scene) throw MeshError(name + ": " + first_line(importer.GetErrorString()));
  return copy_triangles(*scene);
}

}  // namespace

bool is_surface_file(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".obj" || extension == ".stl" || extension == ".ply";
}

TriangleSurface read_surface(const std::filesystem::path& path) {
  const std::string name = path.string(), extension = lower_extension(path);
  const std::string contents = load_file(path);
  if (!is_surface_file(path))
    throw MeshError(name + ": the extension " + in_quotes(path.extension().string()) + " is none of .obj, .stl, .ply");
  TriangleSurface surface =
      extension == ".ply" ? read_ply(name, contents) : read_through_assimp(name, contents, extension);
  surface.source = name;
  try {
    repair(surface);
  } catch (const std::invalid_argument& error) {
    throw MeshError(error.what());
  }
  return surface;
}

}  // namespace penalty
