#include "penalty/mesh/builders.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "builder_arguments.h"
#include "icosphere.h"

namespace penalty {
namespace {

// The five tetrahedra of a cell. Corner b lies at (b & 1, b >> 1 & 1, b >> 2 & 1). The first is the regular one in the
// middle, the others cut a corner off; `odd` is the mirror image of `even`.
//
//        6-------7
//       /|      /|      even: the diagonals of the faces join 0, 3, 5, 6
//      4-------5 |      odd:  they join 1, 2, 4, 7
//      | 2-----|-3
//      |/      |/
//      0-------1
constexpr Tetrahedron even[5] = {{0, 3, 6, 5}, {1, 0, 5, 3}, {2, 0, 3, 6}, {4, 0, 6, 5}, {7, 3, 5, 6}};
constexpr Tetrahedron odd[5] = {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}};

// The six around the diagonal 0-7: each goes from 0 to 7 along the three axes in one of their orders.
constexpr Tetrahedron around_diagonal[6] = {{0, 1, 3, 7}, {0, 5, 1, 7}, {0, 3, 2, 7},
                                            {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 6, 4, 7}};

std::span<const Tetrahedron> cell_tetrahedra(BoxSplit split, bool is_even) {
  if (split == BoxSplit::six) return around_diagonal;
  return is_even ? even : odd;
}

// The builders know the orientation of what they build up to sign: no repair is worth reporting.
TetMesh finished(TetMesh mesh) {
  repair(mesh);
  mesh.repairs = {};
  return mesh;
}

// A disc of triangles in rings about its middle, a triangular lattice bent round. Its vertices have three colours, so
// that each triangle has one vertex of each.
struct Disc {
  std::vector<std::array<Real, 2>> points;  // in the unit disc
  std::vector<int> colours;
  std::vector<Triangle> triangles;

  explicit Disc(int layers) {
    points.push_back({0, 0});
    colours.push_back(0);
    for (int ring = 1; ring <= layers; ++ring)
      for (int k = 0; k < 6 * ring; ++k) {
        const Real angle = 2 * std::numbers::pi * k / (6 * ring), radius = Real(ring) / layers;
        points.push_back({radius * std::cos(angle), radius * std::sin(angle)});
        // Along side s of the hexagon the lattice coordinates run from the corner by steps of one colour; the corners
        // of a ring alternate between +ring and -ring, modulo 3.
        const int side = k / ring, step = k % ring;
        const int colour = side % 2 == 0 ? ring + step : 2 * ring + 2 * step;
        colours.push_back(colour % 3);
      }
    const auto at = [](int ring, int k) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + k % (6 * ring); };
    for (int ring = 1; ring <= layers; ++ring)
      for (int side = 0; side < 6; ++side)
        for (int k = 0; k < ring; ++k) {
          const int outer = side * ring + k, inner = side * (ring - 1) + k;
          triangles.push_back({at(ring, outer), at(ring, outer + 1), at(ring - 1, inner)});
          if (k + 1 < ring) triangles.push_back({at(ring, outer + 1), at(ring - 1, inner + 1), at(ring - 1, inner)});
        }
  }
};

}  // namespace

TetMesh make_box(const Vector3& size, const std::array<int, 3>& cells, BoxSplit split) {
  constexpr int most_cells = 100'000'000;
  std::int64_t total = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    require_length(size[axis], "make_box: size." + name);
    require_count(cells[axis], 1, most_cells, "make_box: cells." + name);
    total *= cells[axis];
    if (total > most_cells)
      throw std::invalid_argument("make_box: cells are more than " + std::to_string(most_cells) + " together");
  }
  std::array<int, 3> order{0, 1, 2};  // slowest direction first
  std::stable_sort(order.begin(), order.end(), [&](int l, int r) { return cells[l] > cells[r]; });
  std::array<int, 3> stride;
  stride[order[2]] = 1;
  stride[order[1]] = cells[order[2]] + 1;
  stride[order[0]] = stride[order[1]] * (cells[order[1]] + 1);

  TetMesh mesh;
  std::vector<std::string> arguments{to_text(size.x()),        to_text(size.y()),        to_text(size.z()),
                                     std::to_string(cells[0]), std::to_string(cells[1]), std::to_string(cells[2])};
  if (split == BoxSplit::six) arguments.push_back("six");
  mesh.source = call("make_box", arguments);
  mesh.vertices.resize(3, Eigen::Index{cells[0] + 1} * (cells[1] + 1) * (cells[2] + 1));
  mesh.tetrahedra.reserve(static_cast<std::size_t>(total) * cell_tetrahedra(split, true).size());
  std::array<int, 3> at;  // of the cell's or vertex's lowest corner
  const auto index = [&](int b) {
    return (at[0] + (b & 1)) * stride[0] + (at[1] + (b >> 1 & 1)) * stride[1] + (at[2] + (b >> 2 & 1)) * stride[2];
  };
  for (at[order[0]] = 0; at[order[0]] <= cells[order[0]]; ++at[order[0]])
    for (at[order[1]] = 0; at[order[1]] <= cells[order[1]]; ++at[order[1]])
      for (at[order[2]] = 0; at[order[2]] <= cells[order[2]]; ++at[order[2]]) {
        for (int axis = 0; axis < 3; ++axis) mesh.vertices(axis, index(0)) = size[axis] * at[axis] / cells[axis];
        if (at[0] == cells[0] || at[1] == cells[1] || at[2] == cells[2]) continue;
        for (const Tetrahedron& t : cell_tetrahedra(split, (at[0] + at[1] + at[2]) % 2 == 0))
          mesh.tetrahedra.push_back({index(t[0]), index(t[1]), index(t[2]), index(t[3])});
      }
  return finished(std::move(mesh));
}

TetMesh make_beam(int cells_across) {
  require_count(cells_across, 1, 200, "make_beam: cells_across");
  TetMesh mesh = make_box({4, 1, 1}, {4 * cells_across, cells_across, cells_across});
  mesh.source = call("make_beam", {std::to_string(cells_across)});
  return mesh;
}

TetMesh make_ball(Real radius, int layers) {
  require_length(radius, "make_ball: radius");
  require_count(layers, 1, 100, "make_ball: layers");
  const Icosahedron icosahedron;
  BallVertices vertices(icosahedron, radius, layers);
  TetMesh mesh;
  mesh.source = call("make_ball", {to_text(radius), std::to_string(layers)});
  // The tetrahedron between the centre and a face is the corner n >= x >= y >= z >= 0 of a grid of cubes, x the layer;
  // of the six tetrahedra along the diagonal of each cube those inside are taken.
  constexpr std::array<std::array<int, 3>, 6> paths{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (int x = 0; x < layers; ++x)  // layer by layer: neighbours in space are at most one layer apart in memory
    for (const Triangle& face : icosahedron.faces)
      for (int y = 0; y <= x; ++y)
        for (int z = 0; z <= y; ++z)
          for (const auto& path : paths) {
            std::array<int, 3> p{x, y, z};
            Tetrahedron t;
            bool inside = true;
            for (int k = 0; k < 4 && inside; ++k) {
              if (k > 0) ++p[path[k - 1]];
              inside = p[0] >= p[1] && p[1] >= p[2];
              if (inside) t[k] = vertices.at(face, {p[0] - p[1], p[1] - p[2], p[2]});
            }
            if (inside) mesh.tetrahedra.push_back(t);
          }
  mesh.vertices = vertices.columns();
  return finished(std::move(mesh));
}

TetMesh make_torus(Real major_radius, Real minor_radius, int layers, int segments) {
  require_length(major_radius, "make_torus: major_radius");
  require_length(minor_radius, "make_torus: minor_radius");
  if (!(minor_radius < major_radius))
    throw std::invalid_argument("make_torus: minor_radius is " + to_text(minor_radius) + ", not below major_radius " +
                                to_text(major_radius));
  require_count(layers, 1, 200, "make_torus: layers");
  require_count(segments, 3, 100'000, "make_torus: segments");
  const Disc disc(layers);
  const int slice = static_cast<int>(disc.points.size());
  if (Real(disc.triangles.size()) * 3 * segments > 1e8)
    throw std::invalid_argument("make_torus: layers " + std::to_string(layers) + " and segments " +
                                std::to_string(segments) + " give more than 10^8 tetrahedra");

  TetMesh mesh;
  mesh.source = call("make_torus",
                     {to_text(major_radius), to_text(minor_radius), std::to_string(layers), std::to_string(segments)});
  mesh.vertices.resize(3, Eigen::Index{slice} * segments);
  for (int s = 0; s < segments; ++s)
    for (int v = 0; v < slice; ++v) {
      const auto [x, y] = disc.points[v];
      // Columns of the three colours are shifted by thirds of a segment: four consecutive vertices round three
      // neighbouring columns are then a tetrahedron close to those of a body-centred cubic lattice.
      const Real angle = 2 * std::numbers::pi * (s + disc.colours[v] / 3.0) / segments;
      const Real distance = major_radius + minor_radius * x;
      mesh.vertices.col(Eigen::Index{s} * slice + v) << distance * std::cos(angle), minor_radius * y,
          distance * std::sin(angle);
    }
  for (int s = 0; s < segments; ++s)
    for (Triangle column : disc.triangles) {
      std::sort(column.begin(), column.end(), [&](int l, int r) { return disc.colours[l] < disc.colours[r]; });
      const auto rung = [&](int k) { return (s + k / 3) % segments * slice + column[k % 3]; };
      for (int k = 0; k < 3; ++k) mesh.tetrahedra.push_back({rung(k), rung(k + 1), rung(k + 2), rung(k + 3)});
    }
  return finished(std::move(mesh));
}

}  // namespace penalty
