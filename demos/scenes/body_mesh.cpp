#include "scenes/body_mesh.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "penalty/mesh/builders.h"
#include "penalty/mesh/read_mesh.h"
#include "penalty/mesh/read_surface.h"

namespace penalty::demo {
namespace {

constexpr Real size = 2;                // of a scaled mesh, along its longest side [m]
constexpr int lattice_cells = 20;       // of an embedded surface, unless the user says otherwise
constexpr Real least_enclosure = 0.75;  // of a surface that is taken for a solid
constexpr Real samples_per_cell = 1.6;  // contact points along the side of a lattice cell

/// Moves the bounding box to the origin and, if `scale`, gives its longest side the standard length.
void place(Eigen::Matrix3Xd& vertices, bool scale) {
  const Vector3 low = vertices.rowwise().minCoeff(), high = vertices.rowwise().maxCoeff();
  const Real factor = scale ? size / (high - low).maxCoeff() : 1;
  vertices = (vertices.colwise() - (low + high) / 2) * factor;
}

BodyMesh built(TetMesh mesh, bool scale) {
  place(mesh.vertices, scale);
  return {std::move(mesh)};
}

BodyMesh embedded(const std::filesystem::path& path, const SceneOptions& options) {
  const int cells = cells_in(options, lattice_cells, 2, 200);
  TriangleSurface surface = read_surface(path);
  place(surface.vertices, options.scale);
  try {
    if (!topology_of(surface).is_closed() && enclosure(surface) < least_enclosure) return {std::move(surface)};
    EmbeddedSurface lattice = embed(surface, {.cells = cells});
    lattice.surface.repairs = surface.repairs;  // what was amiss with the file
    return {lattice.lattice, std::move(lattice)};
  } catch (const std::invalid_argument& error) {
    throw MeshError(error.what());
  }
}

}  // namespace

const TetMesh& BodyMesh::solid() const {
  if (is_shell())
    throw std::invalid_argument(source() +
                                ": an open sheet where a solid is wanted: close it, or let it fall as cloth (drop)");
  return std::get<TetMesh>(mesh);
}

const Eigen::Matrix3Xd& BodyMesh::vertices() const {
  return std::visit([](const auto& m) -> const Eigen::Matrix3Xd& { return m.vertices; }, mesh);
}

std::span<const Tetrahedron> BodyMesh::tetrahedra() const {
  return is_shell() ? std::span<const Tetrahedron>() : solid().tetrahedra;
}

std::vector<Edge> BodyMesh::edges() const {
  return is_shell() ? edges_of(shell().triangles) : edges_of(solid().tetrahedra);
}

std::string BodyMesh::source() const {
  if (surface) return surface->surface.source;
  return is_shell() ? shell().source : solid().source;
}

std::string BodyMesh::repairs() const {
  if (!surface && !is_shell()) return to_text(solid().repairs);
  const TriangleSurface& read = surface ? surface->surface : shell();
  SurfaceRepair repairs = read.repairs;
  repairs.merged_vertices = 0;  // some formats have no others, and Assimp takes all apart
  std::string text = to_text(repairs);
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const SurfaceTopology topology = topology_of(read);
  if (surface && !topology.is_closed())
    add(std::to_string(topology.open_edges) + " open and " + std::to_string(topology.branching_edges) +
        " branching edges: filled by the winding number");
  if (surface && surface->pieces > 1) add(std::to_string(surface->pieces) + " pieces in one body");
  return text;
}

Eigen::VectorXd BodyMesh::vertex_shares() const {
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(vertices().cols());
  const auto share_out = [&shares](const auto& elements, const std::vector<Real>& sizes) {
    for (std::size_t e = 0; e < sizes.size(); ++e)
      for (int i : elements[e]) shares[i] += sizes[e] / static_cast<Real>(elements[e].size());
  };
  if (is_shell())
    share_out(shell().triangles, areas_of(vertices(), shell().triangles));
  else
    share_out(solid().tetrahedra, signed_volumes(vertices(), solid().tetrahedra));
  return shares;
}

Eigen::Matrix3Xd BodyMesh::drawn(const Eigen::Matrix3Xd& positions) const {
  return surface ? skin(*surface, positions) : positions;
}

std::vector<Triangle> BodyMesh::drawn_triangles() const {
  if (is_shell()) return shell().triangles;
  return surface ? surface->surface.triangles : boundary_faces(solid().tetrahedra);
}

std::vector<WeightedPoint> BodyMesh::contact_points() const {
  std::vector<WeightedPoint> points;
  if (!surface) return points;
  // The lattice knows its cell only through its shape: the longest edge of a tetrahedron is one cell long.
  const Tetrahedron& t = solid().tetrahedra.front();
  Real cell = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) cell = std::max(cell, (vertices().col(t[i]) - vertices().col(t[j])).norm());
  for (int vertex : contact_samples(*surface, cell / samples_per_cell)) {
    WeightedPoint point;
    point.particles = surface->stencils[vertex];
    for (int k = 0; k < 4; ++k) point.weights[k] = surface->weights(k, vertex);
    point.size = 4;
    points.push_back(point);
  }
  return points;
}

std::filesystem::path bunny_path() { return "/usr/share/glmark2/models/bunny.obj"; }

BodyMesh load_body(const SceneOptions& options, const std::string& by_default) {
  const std::string& name = options.mesh.empty() ? by_default : options.mesh;
  if (name == "torus") {
    const int cells = cells_in(options, 20, 2, 400);
    return built(make_torus(0.7, 0.3, std::max(1, cells * 3 / 20), std::max(3, cells * 27 / 20)), options.scale);
  }
  if (name == "ball") return built(make_ball(1, cells_in(options, 12, 2, 100) / 2), options.scale);
  if (name == "box") {
    const int cells = cells_in(options, 10, 2, 100);
    return built(make_box({2, 2, 2}, {cells, cells, cells}), options.scale);
  }
  if (name == "bunny") {
    if (!std::filesystem::exists(bunny_path()))
      throw MeshError(bunny_path().string() + ": no such file; install the package glmark2-data, or give --mesh");
    return embedded(bunny_path(), options);
  }
  if (is_surface_file(name)) return embedded(name, options);
  if (!is_tetrahedral_mesh_file(name) && !std::filesystem::exists(name))
    throw MeshError(name + ": no such file, and none of bunny, torus, ball, box");
  TetMesh mesh = read_mesh(name);
  if (options.cells) throw std::invalid_argument("--cells does not apply to a mesh that has its tetrahedra");
  return built(std::move(mesh), options.scale);
}

int cells_in(const SceneOptions& options, int by_default, int least, int most) {
  const int cells = options.cells.value_or(by_default);
  if (cells < least || cells > most)
    throw std::invalid_argument("--cells is " + std::to_string(cells) + ", must be " + std::to_string(least) + " to " +
                                std::to_string(most) + " for this mesh");
  return cells;
}

void refuse_mesh(const SceneOptions& options, std::string_view scene) {
  if (!options.mesh.empty())
    throw std::invalid_argument("scene " + std::string(scene) + " makes its own mesh: --mesh does not apply");
}

void refuse_model(const SceneOptions& options, std::string_view scene) {
  if (options.model)
    throw std::invalid_argument("scene " + std::string(scene) + " is about its own elements: --model does not apply");
}

}  // namespace penalty::demo
