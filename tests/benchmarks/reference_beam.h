// The beam that the benchmarks step: 4 x 1 x 1 m, E = 10 MPa, 1000 kg/m³, held at x = 0.
#pragma once
#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"

namespace penalty {

inline PotentialField reference_beam_field(const TetMesh& mesh, int cells_across) {
  constexpr Real young = 1e7;
  PotentialField field(mesh.vertices);
  const std::vector<Edge> edges = edges_of(mesh.tetrahedra);
  std::vector<Real> lengths, volumes;
  for (const auto& [a, b] : edges)
    lengths.push_back(0.4 * young / cells_across * (mesh.vertices.col(b) - mesh.vertices.col(a)).squaredNorm());
  for (const Real volume : signed_volumes(mesh.vertices, mesh.tetrahedra)) volumes.push_back(young * volume);
  field.add<Length>(edges, lengths);
  field.add<TetrahedronVolume>(mesh.tetrahedra, volumes);
  return field;
}

}  // namespace penalty
