#include "fuzz/readers.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "fuzz/finding.h"
#include "penalty/mesh/read_mesh.h"
#include "penalty/mesh/read_surface.h"
#include "penalty/mesh/write_mesh.h"

namespace penalty::testing {
namespace {

constexpr std::array format_names{"vtk", "gmsh", "tetgen", "ply", "obj", "stl"};

void check_points(const Eigen::Matrix3Xd& vertices, std::size_t num_bytes) {
  require(vertices.allFinite(), "a vertex is not finite");
  require(static_cast<std::size_t>(vertices.size()) <= num_bytes, "more coordinates than bytes");
}

template <class Elements>
void check_indices(const Elements& elements, Eigen::Index num_vertices) {
  std::vector<bool> mentioned(static_cast<std::size_t>(num_vertices), false);
  for (const auto& element : elements)
    for (int v : element) {
      require(v >= 0 && v < num_vertices, "index " + std::to_string(v) + " is out of range");
      mentioned[static_cast<std::size_t>(v)] = true;
    }
  for (std::size_t v = 0; v < mentioned.size(); ++v)
    require(mentioned[v], "vertex " + std::to_string(v) + " belongs to no element");
}

/// The volume of the parallelepiped, in units of its longest edge: neither overflows nor vanishes.
Real relative_volume(Matrix3 edges) {
  const Real longest = edges.colwise().stableNorm().maxCoeff();
  return longest > 0 ? (edges / longest).determinant() : 0;
}

void check_tetrahedra(const TetMesh& mesh) {
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    Matrix3 edges;
    for (int k = 0; k < 3; ++k)
      edges.col(k) = mesh.vertices.col(mesh.tetrahedra[i][k + 1]) - mesh.vertices.col(mesh.tetrahedra[i][0]);
    require(relative_volume(edges) > 0, "tetrahedron " + std::to_string(i) + " is not positively oriented");
  }
}

void check_groups(const std::vector<MeshGroup>& groups, std::size_t size) {
  for (const auto& [name, members] : groups) {
    require(!members.empty(), "the group " + name + " is empty");
    for (std::size_t i = 0; i < members.size(); ++i) {
      require(members[i] >= 0 && static_cast<std::size_t>(members[i]) < size, "the group " + name + " is out of range");
      require(i == 0 || members[i - 1] < members[i], "the group " + name + " is not in order");
    }
  }
}

// Whether the surface is closed; if it is, it must be outward, and say so.
bool check_sides(const TriangleSurface& surface) {
  std::map<std::pair<int, int>, int> directed;
  for (const Triangle& t : surface.triangles)
    for (int k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
  const bool is_closed = std::all_of(directed.begin(), directed.end(), [&](const auto& use) {
    return use.second == 1 && directed.contains({use.first.second, use.first.first});
  });
  require(topology_of(surface).is_closed() == is_closed, "a surface is not as closed as it says");
  if (!is_closed) return false;
  const Real size = (surface.vertices.rowwise().maxCoeff() - surface.vertices.rowwise().minCoeff()).maxCoeff();
  require(size > 0, "the surface is a point");
  Real volume = 0, magnitude = 0;
  for (const Triangle& t : surface.triangles) {
    Matrix3 corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = (surface.vertices.col(t[k]) - surface.vertices.col(0)) / size;
    volume += corners.determinant();
    magnitude += std::abs(corners.determinant());
  }
  require(volume >= -1e-12 * magnitude, "the surface is inside-out");
  return true;
}

/// `stem` is the path of the file, or of both of a pair, without extension.
void check_complaint(const std::string& text, const std::string& stem) {
  require(text.starts_with(stem + "."), "the complaint does not begin with the file's name: " + text);
  const std::string_view rest = std::string_view(text).substr(stem.size());
  require(rest.find(':') < std::string_view(".node:").size(), "the complaint does not name its file alone: " + text);
  require(rest.size() <= 600, "a complaint of " + std::to_string(text.size()) + " characters");
  for (char c : rest)
    require(c >= ' ' && c != '\x7f',
            "a control character, " + std::to_string(static_cast<unsigned char>(c)) + ", in: " + text);
}

}  // namespace

std::string name_of(FileFormat format) { return format_names.at(static_cast<std::size_t>(format)); }

FileFormat format_of(std::string_view name) {
  for (FileFormat format : file_formats)
    if (name_of(format) == name) return format;
  throw std::invalid_argument("unknown format \"" + std::string(name) + "\"");
}

ReaderCheck::ReaderCheck(FileFormat format) : format_(format) {
  std::string pattern = (std::filesystem::temp_directory_path() / "penalty-fuzz-XXXXXX").string();
  if (!mkdtemp(pattern.data())) throw std::runtime_error(pattern + ": cannot be made");
  folder_ = pattern;
}

ReaderCheck::~ReaderCheck() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::filesystem::path ReaderCheck::write(const std::string& name, std::string_view bytes) const {
  std::filesystem::remove(folder_ /
                          name);  // a file that is truncated instead may be flushed to disk: a hundred times slower
  std::ofstream(folder_ / name, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return folder_ / name;
}

void ReaderCheck::read_tetrahedra(std::string_view bytes) const {
  std::filesystem::path path;
  if (format_ == FileFormat::tetgen) {
    const std::size_t cut = std::min(bytes.find(tetgen_cut), bytes.size());
    path = write("a.node", bytes.substr(0, cut));
    write("a.ele", bytes.substr(std::min(cut + tetgen_cut.size(), bytes.size())));
  } else {
    path = write(format_ == FileFormat::vtk ? "a.vtk" : "a.msh", bytes);
  }
  const TetMesh mesh = read_mesh(path);
  require(!mesh.tetrahedra.empty(), "a mesh without tetrahedra");
  check_points(mesh.vertices, bytes.size());
  check_indices(mesh.tetrahedra, mesh.vertices.cols());
  check_tetrahedra(mesh);
  check_groups(mesh.regions, mesh.tetrahedra.size());
  check_groups(mesh.vertex_sets, static_cast<std::size_t>(mesh.vertices.cols()));

  write_vtk(folder_ / "back.vtk", mesh);
  const TetMesh back = read_mesh(folder_ / "back.vtk");
  require(back.vertices == mesh.vertices, "written and read again, a vertex has moved");
  require(back.tetrahedra == mesh.tetrahedra, "written and read again, a tetrahedron has changed");
}

bool ReaderCheck::read_triangles(std::string_view bytes) const {
  const TriangleSurface surface = read_surface(write("a." + name_of(format_), bytes));
  require(!surface.triangles.empty(), "a surface without triangles");
  check_points(surface.vertices, bytes.size());
  check_indices(surface.triangles, surface.vertices.cols());
  return check_sides(surface);
}

bool ReaderCheck::read(std::string_view bytes) const {
  const bool solid = format_ == FileFormat::vtk || format_ == FileFormat::gmsh || format_ == FileFormat::tetgen;
  try {
    if (!solid) return read_triangles(bytes);
    read_tetrahedra(bytes);
    return true;
  } catch (const MeshError& error) {
    check_complaint(error.what(), (folder_ / "a").string());
    return false;
  } catch (const Finding&) {
    throw;
  } catch (const std::exception& error) {
    throw Finding(std::string("an exception that is no MeshError: ") + error.what());
  }
}

}  // namespace penalty::testing
