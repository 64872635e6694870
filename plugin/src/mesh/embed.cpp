#include "penalty/mesh/embed.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bcc_lattice.h"
#include "overlap.h"
#include "winding_number.h"

namespace penalty {
namespace {

using Id = BccLattice::Id;
enum class Place : char { unknown, outside, inside, surface };

Points<3> corners(const TriangleSurface& surface, const Triangle& triangle) {
  Points<3> points;
  for (int k = 0; k < 3; ++k) points.col(k) = surface.vertices.col(triangle[k]);
  return points;
}

// Tetrahedra that the surface touches. `holding` is the tetrahedron of each surface vertex.
void mark_surface(const TriangleSurface& surface, const BccLattice& lattice, const std::vector<Id>& holding,
                  std::vector<Place>& places) {
  constexpr Real slack = 1e-12;  // cells
  for (Id id : holding) places[id] = Place::surface;
  for (const Triangle& triangle : surface.triangles) {
    // Within one tetrahedron, as most small triangles are: it is marked already. One that only touches its neighbours
    // from within needs none of them.
    if (holding[triangle[0]] == holding[triangle[1]] && holding[triangle[1]] == holding[triangle[2]]) continue;
    const Points<3> points = corners(surface, triangle);
    const BccLattice::Cell high = lattice.cell_at(points.rowwise().maxCoeff());
    BccLattice::Cell low = lattice.cell_at(points.rowwise().minCoeff());
    for (int& i : low) i = std::max(i - 1, 0);  // tetrahedra reach from a cell into the next higher one
    Points<3> in_cells;
    for (int k = 0; k < 3; ++k) in_cells.col(k) = lattice.in_cells(points.col(k));
    BccLattice::Cell cell;
    for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0])
      for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1])
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2]) {
          const Points<3> seen = in_cells.colwise() - Vector3(cell[0], cell[1], cell[2]);
          for (int part = 0; part < 12; ++part)
            if (Place& place = places[lattice.tetrahedron(cell, part)];
                place == Place::unknown && triangle_touches_tetrahedron(seen, BccLattice::shapes()[part], slack))
              place = Place::surface;
        }
  }
}

// The tetrahedra that are joined to `start` by faces and share its place, which becomes `place`.
std::vector<Id> flood(const BccLattice& lattice, Id start, Place place, std::vector<Place>& places) {
  const Place old = places[start];
  std::vector<Id> reached{start};
  places[start] = place;
  for (std::size_t i = 0; i < reached.size(); ++i)
    for (Id next : lattice.neighbours(reached[i]))
      if (next >= 0 && places[next] == old) {
        places[next] = place;
        reached.push_back(next);
      }
  return reached;
}

// What a closed surface does not touch lies on one side of it, region by region. Through holes a region may reach in.
void mark_regions(const TriangleSurface& surface, const BccLattice& lattice, std::vector<Place>& places) {
  const bool is_closed = topology_of(surface).is_closed();
  const WindingNumber winding(surface);
  for (Id id = 0; id < lattice.num_tetrahedra(); ++id) {
    if (places[id] != Place::unknown) continue;
    const Vector3 middle = lattice.points_of(id).rowwise().mean();
    const Place place = std::abs(winding.at(middle)) > 0.5 ? Place::inside : Place::outside;
    if (is_closed)
      flood(lattice, id, place, places);
    else
      places[id] = place;
  }
}

int count_lattice_pieces(const BccLattice& lattice, const std::vector<Place>& places) {
  std::vector<Place> kept(places.size(), Place::outside);
  int pieces = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i] == Place::inside || places[i] == Place::surface) kept[i] = Place::inside;
  for (Id id = 0; id < lattice.num_tetrahedra(); ++id)
    if (kept[id] == Place::inside) {
      flood(lattice, id, Place::outside, kept);
      ++pieces;
    }
  return pieces;
}

Eigen::Vector4d barycentric(const Points<4>& p, const Vector3& point) {
  Matrix3 sides;
  sides << p.col(1) - p.col(0), p.col(2) - p.col(0), p.col(3) - p.col(0);
  const Vector3 upper = sides.inverse() * (point - p.col(0));
  return {1 - upper.sum(), upper[0], upper[1], upper[2]};
}

}  // namespace

EmbeddedSurface embed(const TriangleSurface& surface, const EmbeddingOptions& options) {
  if (options.cells < 1 || options.cells > 200)
    throw std::invalid_argument("embed: cells is " + std::to_string(options.cells) + ", not between 1 and 200");
  EmbeddedSurface embedded;
  embedded.surface = surface;
  repair(embedded.surface);
  const TriangleSurface& skin = embedded.surface;

  const Vector3 low = skin.vertices.rowwise().minCoeff(), high = skin.vertices.rowwise().maxCoeff();
  const Real size = (high - low).maxCoeff() / options.cells;
  const BccLattice lattice(low, high, size);
  std::vector<Place> places(static_cast<std::size_t>(lattice.num_tetrahedra()), Place::unknown);
  for (Id id = 0; id < lattice.num_tetrahedra(); ++id)
    if (!lattice.exists(id)) places[id] = Place::outside;
  std::vector<Id> holding(static_cast<std::size_t>(skin.vertices.cols()));
  for (std::size_t v = 0; v < holding.size(); ++v) {
    holding[v] = lattice.tetrahedron_at(skin.vertices.col(static_cast<Eigen::Index>(v)));
    if (holding[v] < 0)  // by rounding alone
      throw std::invalid_argument("embed: the surface is too small for its distance from the origin");
  }
  mark_surface(skin, lattice, holding, places);
  mark_regions(skin, lattice, places);
  embedded.pieces = count_lattice_pieces(lattice, places);

  std::vector<int> new_index(static_cast<std::size_t>(lattice.num_vertices()), -1);
  TetMesh& mesh = embedded.lattice;
  mesh.source = skin.source + " embedded in " + std::to_string(options.cells) + " cells";
  for (Id id = 0; id < lattice.num_tetrahedra(); ++id)
    if (places[id] != Place::outside) {
      mesh.tetrahedra.push_back(lattice.vertices_of(id));
      for (int v : mesh.tetrahedra.back()) new_index[v] = 0;
    }
  mesh.vertices.resize(3, std::count(new_index.begin(), new_index.end(), 0));
  int next = 0;
  for (Id v = 0; v < lattice.num_vertices(); ++v)
    if (new_index[v] == 0) {
      mesh.vertices.col(next) = lattice.position(v);
      new_index[v] = next++;
    }
  for (Tetrahedron& t : mesh.tetrahedra)
    for (int& v : t) v = new_index[v];
  repair(mesh);

  embedded.weights.resize(4, skin.vertices.cols());
  embedded.stencils.reserve(holding.size());
  for (std::size_t v = 0; v < holding.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    Tetrahedron stencil = lattice.vertices_of(holding[v]);
    for (int& corner : stencil) corner = new_index[corner];
    embedded.stencils.push_back(stencil);
    embedded.weights.col(column) = barycentric(lattice.points_of(holding[v]), skin.vertices.col(column));
  }
  return embedded;
}

void skin(const EmbeddedSurface& embedded, const Eigen::Matrix3Xd& lattice_positions,
          Eigen::Matrix3Xd& surface_positions) {
  if (lattice_positions.cols() != embedded.lattice.vertices.cols())
    throw std::invalid_argument("skin: " + std::to_string(lattice_positions.cols()) + " lattice positions for " +
                                std::to_string(embedded.lattice.vertices.cols()) + " lattice vertices");
  surface_positions.resize(3, embedded.weights.cols());
  for (std::size_t v = 0; v < embedded.stencils.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < 4; ++k) sum += embedded.weights(k, column) * lattice_positions.col(embedded.stencils[v][k]);
    surface_positions.col(column) = sum;
  }
}

Eigen::Matrix3Xd skin(const EmbeddedSurface& embedded, const Eigen::Matrix3Xd& lattice_positions) {
  Eigen::Matrix3Xd surface_positions;
  skin(embedded, lattice_positions, surface_positions);
  return surface_positions;
}

}  // namespace penalty
