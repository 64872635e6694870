#include "penalty/mesh/write_mesh.h"

#include <algorithm>
#include <fstream>

#include "penalty/math/text.h"

namespace penalty {
namespace {

void check(const MeshScalars& scalars, std::size_t count, const char* element) {
  const bool bad_name = scalars.name.empty() || std::any_of(scalars.name.begin(), scalars.name.end(),
                                                            [](char c) { return c <= ' ' || c == '\x7f'; });
  if (bad_name)
    throw std::invalid_argument("write_vtk: scalars need a name without white space, not '" + scalars.name + "'");
  if (scalars.values.size() != count)
    throw std::invalid_argument("write_vtk: " + scalars.name + " has " + std::to_string(scalars.values.size()) +
                                " values for " + std::to_string(count) + " " + element);
}

void add_scalars(std::string& text, std::span<const MeshScalars> fields, std::size_t count, const char* section) {
  if (fields.empty()) return;
  text += section + std::string(" ") + std::to_string(count) + "\n";
  for (const MeshScalars& field : fields) {
    text += "SCALARS " + field.name + " double 1\nLOOKUP_TABLE default\n";
    for (Real value : field.values) {
      text += exact_text(value);
      text += '\n';
    }
  }
}

// VTK gives the title one line of at most 256 characters.
std::string title(const std::string& source) {
  std::string line = source.empty() ? "tetrahedral mesh" : source.substr(0, 250);
  std::replace_if(line.begin(), line.end(), [](char c) { return c < ' ' && c >= 0; }, ' ');
  return line;
}

}  // namespace

void write_vtk(const std::filesystem::path& path, const TetMesh& mesh, std::span<const MeshScalars> vertex_scalars,
               std::span<const MeshScalars> tetrahedron_scalars) {
  const auto vertices = static_cast<std::size_t>(mesh.vertices.cols());
  const std::size_t tetrahedra = mesh.tetrahedra.size();
  for (const MeshScalars& scalars : vertex_scalars) check(scalars, vertices, "vertices");
  for (const MeshScalars& scalars : tetrahedron_scalars) check(scalars, tetrahedra, "tetrahedra");

  std::string text = "# vtk DataFile Version 3.0\n" + title(mesh.source) + "\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  text += "POINTS " + std::to_string(vertices) + " double\n";
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      text += exact_text(mesh.vertices(axis, v));
      text += axis < 2 ? ' ' : '\n';
    }
  text += "CELLS " + std::to_string(tetrahedra) + " " + std::to_string(5 * tetrahedra) + "\n";
  for (const Tetrahedron& t : mesh.tetrahedra) {
    text += '4';
    for (int v : t) text += ' ' + std::to_string(v);
    text += '\n';
  }
  text += "CELL_TYPES " + std::to_string(tetrahedra) + "\n";
  for (std::size_t i = 0; i < tetrahedra; ++i) text += "10\n";
  add_scalars(text, vertex_scalars, vertices, "POINT_DATA");
  add_scalars(text, tetrahedron_scalars, tetrahedra, "CELL_DATA");

  std::ofstream stream(path, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.flush();
  if (!stream) throw MeshError(path.string() + ": cannot be written");
}

}  // namespace penalty
