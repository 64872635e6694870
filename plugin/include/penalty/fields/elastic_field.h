// Fields of tetrahedral meshes.
#pragma once
#include "penalty/energy/material.h"
#include "penalty/fields/potential_field.h"

namespace penalty {

/// Springs on the edges and volume penalties on the tetrahedra, one stiffness in joules for every element: the seed's
/// own form. `vertices` is 3 x V [m]. Stiffness then grows as the mesh is refined; see the overload with a material.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness);

/// Elements of `model` with stiffnesses that stand for a material (see `Material`), whatever the mesh. At its least
/// Poisson ratio the volume term of a model of springs vanishes and is left out.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model = ElasticModel::springs_volumes);

/// `make_elastic_field` of the same arguments, but while the body is far from its rest shape it is of the neo-Hookean
/// material with the same shear modulus and no resistance to changes of volume beyond that, see
/// `PotentialField::add_soft_phase`: finds back from any start, whatever the material.
PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model = ElasticModel::neo_hookean,
                                     const PhaseThresholds& thresholds = {});

}  // namespace penalty
