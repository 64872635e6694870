#include "penalty/mesh/read_mesh.h"

#include "raw_mesh.h"

namespace penalty {
namespace {

std::filesystem::path with_suffix(std::filesystem::path stem, const char* suffix) { return stem += suffix; }

bool is_tetgen_stem(const std::filesystem::path& path) {
  std::error_code error;
  return path.has_filename() && std::filesystem::exists(with_suffix(path, ".node"), error) &&
         std::filesystem::exists(with_suffix(path, ".ele"), error);
}

// The other file of a TetGen pair: .ele beside .node, .ELE beside .NODE.
std::filesystem::path partner(const std::filesystem::path& path, const char* lower, const char* upper) {
  std::filesystem::path other = path;
  const std::string extension = path.extension().string();
  return other.replace_extension(extension == lower_case(extension) ? lower : upper);
}

}  // namespace

bool is_tetrahedral_mesh_file(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".vtk" || extension == ".vtu" || extension == ".msh" || extension == ".node" ||
         extension == ".ele" || is_tetgen_stem(path);
}

TetMesh read_mesh(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".vtk" || extension == ".vtu") return read_vtk(path);
  if (extension == ".msh") return read_gmsh(path);
  if (extension == ".node") return read_tetgen(path, partner(path, ".ele", ".ELE"), path);
  if (extension == ".ele") return read_tetgen(partner(path, ".node", ".NODE"), path, path);
  if (is_tetgen_stem(path)) return read_tetgen(with_suffix(path, ".node"), with_suffix(path, ".ele"), path);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw MeshError(path.string() + ": no such file");
  if (std::filesystem::is_directory(path, error)) throw MeshError(path.string() + ": is a directory, not a mesh file");
  throw MeshError(path.string() + ": the extension " + in_quotes(path.extension().string()) +
                  " is none of .vtk, .vtu, .msh, .node, .ele");
}

}  // namespace penalty
