#include "penalty/mesh/surface_builders.h"

#include "builder_arguments.h"
#include "icosphere.h"

namespace penalty {

TriangleSurface make_sheet(Real width, Real height, int cells_x, int cells_y, Diagonals diagonals) {
  constexpr int most_cells = 100'000'000;
  require_length(width, "make_sheet: width");
  require_length(height, "make_sheet: height");
  require_count(cells_x, 1, most_cells, "make_sheet: cells_x");
  require_count(cells_y, 1, most_cells, "make_sheet: cells_y");
  if (std::int64_t{cells_x} * cells_y > most_cells)
    throw std::invalid_argument("make_sheet: cells are more than " + std::to_string(most_cells) + " together");

  TriangleSurface sheet;
  sheet.source =
      call("make_sheet", {to_text(width), to_text(height), std::to_string(cells_x), std::to_string(cells_y)});
  sheet.vertices.resize(3, Eigen::Index{cells_x + 1} * (cells_y + 1));
  sheet.triangles.reserve(2 * static_cast<std::size_t>(cells_x) * static_cast<std::size_t>(cells_y));
  const auto index = [&](int i, int j) { return i + j * (cells_x + 1); };
  for (int j = 0; j <= cells_y; ++j)
    for (int i = 0; i <= cells_x; ++i) {
      sheet.vertices.col(index(i, j)) << width * i / cells_x, height * j / cells_y, 0;
      if (i == cells_x || j == cells_y) continue;
      const int a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
      if (diagonals == Diagonals::one_way || (i + j) % 2 == 0)
        sheet.triangles.insert(sheet.triangles.end(), {{a, b, c}, {a, c, d}});
      else
        sheet.triangles.insert(sheet.triangles.end(), {{a, b, d}, {b, c, d}});
    }
  return sheet;
}

TriangleSurface make_sphere(Real radius, int subdivisions) {
  require_length(radius, "make_sphere: radius");
  require_count(subdivisions, 1, 250, "make_sphere: subdivisions");
  const Icosahedron icosahedron;
  BallVertices vertices(icosahedron, radius, subdivisions);
  TriangleSurface sphere;
  sphere.source = call("make_sphere", {to_text(radius), std::to_string(subdivisions)});
  sphere.triangles.reserve(20 * static_cast<std::size_t>(subdivisions) * static_cast<std::size_t>(subdivisions));
  const int n = subdivisions;
  for (const Triangle& face : icosahedron.faces) {
    const auto at = [&](int i, int j) { return vertices.at(face, {n - i - j, i, j}); };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        sphere.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
        if (i + j + 1 < n) sphere.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
  }
  sphere.vertices = vertices.columns();
  return sphere;
}

}  // namespace penalty
