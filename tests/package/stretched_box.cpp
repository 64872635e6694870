// No Bullet: a box from a surface file, and the energy of its stretch, which is known in closed form.
#include <cmath>
#include <cstdio>
#include <fstream>

#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"
#include "penalty/mesh/read_surface.h"

int main() {
  std::ofstream("wedge.obj") << "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const penalty::TriangleSurface wedge = penalty::read_surface("wedge.obj");
  double wedge_volume = 0;
  for (const auto& [a, b, c] : wedge.triangles)
    wedge_volume += wedge.vertices.col(a).dot(wedge.vertices.col(b).cross(wedge.vertices.col(c))) / 6;

  // Stretched alike in all directions: C = s - 1 of every edge, C = s^3 - 1 of every tetrahedron.
  const penalty::Material material{.young = 1e4, .poisson = 0.4};
  const penalty::TetMesh box = penalty::make_box({1, 2, 3}, {2, 2, 2});
  const penalty::PotentialField field = penalty::make_elastic_field(box.vertices, box.tetrahedra, material);
  const double s = 1.1, mu = material.lame_mu(), lambda = material.lame_lambda();
  const double expected = 6 * (15 * mu * std::pow(s - 1, 2) + (lambda - mu) * std::pow(s * s * s - 1, 2)) / 2;
  const double energy = field.energy(s * field.rest_positions());

  std::printf("a wedge of %g m³; a box of 6 m³, stretched by %g: %.6f J, expected %.6f J\n", wedge_volume, s, energy,
              expected);
  return std::abs(wedge_volume - 1) < 1e-6 && std::abs(energy - expected) < 1e-9 * expected ? 0 : 1;
}
