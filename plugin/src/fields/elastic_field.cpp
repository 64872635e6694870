#include "penalty/fields/elastic_field.h"

#include <cmath>

namespace penalty {

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness) {
  PotentialField field(vertices);
  field.add<Length>(edges_of(tetrahedra), stiffness);
  field.add<TetrahedronVolume>(tetrahedra, stiffness);
  return field;
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model) {
  material.check(model);
  PotentialField field(vertices);
  std::vector<Real> volumes = signed_volumes(vertices, tetrahedra);
  for (Real& volume : volumes) volume = std::abs(volume);
  const auto scaled = [](std::vector<Real> shares, Real density) {
    for (Real& share : shares) share *= density;
    return shares;
  };
  if (model == ElasticModel::neo_hookean) {
    field.add(StableNeoHookean::with_ratio(material.lame_lambda() / material.lame_mu()), tetrahedra,
              scaled(volumes, material.lame_mu()));
  } else {
    const std::vector<Edge> edges = edges_of(tetrahedra);
    field.add<Length>(edges,
                      scaled(edge_volume_shares(edges, tetrahedra, volumes), material.length_stiffness_density(model)));
    if (material.area_stiffness_density(model) > 0) {
      const std::vector<Triangle> faces = faces_of(tetrahedra);
      field.add<TriangleArea>(
          faces, scaled(face_volume_shares(faces, tetrahedra, volumes), material.area_stiffness_density(model)));
    }
    // The least Poisson ratio, computed in floating point, may leave a volume term of either sign in the last digits.
    const Real density = material.volume_stiffness_density(model);
    if (density > 1e-12 * material.young) field.add<TetrahedronVolume>(tetrahedra, scaled(volumes, density));
  }
  if (material.damping > 0)
    for (const auto& potential : field.potentials())
      static_cast<ElementBatch&>(*potential).set_damping_time(material.damping);
  return field;
}

PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model, const PhaseThresholds& thresholds) {
  material.check(model);
  // mu = E / 2 (1 + nu) stays; without lambda nu is 0.
  Material soft = material;
  soft.young = 2 * material.lame_mu();
  soft.poisson = 0;
  PotentialField field = make_elastic_field(vertices, tetrahedra, material, model);
  field.add_soft_phase(tetrahedra, make_elastic_field(vertices, tetrahedra, soft, ElasticModel::neo_hookean),
                       thresholds);
  return field;
}

}  // namespace penalty
