// Fields of tetrahedral meshes and of thin sheets.
#pragma once
#include "penalty/energy/material.h"
#include "penalty/fields/potential_field.h"

namespace penalty {

/// Springs on the edges and volume penalties on the tetrahedra, one stiffness in joules for every element: the seed's
/// own form. `vertices` is 3 x V [m]. Stiffness then grows as the mesh is refined; see the overload with a material.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness);

/// Elements of `model` with stiffnesses that stand for a material (see `Material`), whatever the mesh. At its least
/// Poisson ratio the volume term of a model of springs vanishes and is left out. Throws std::invalid_argument that names
/// the number of `material` that is out of range, or the tetrahedron that is flat.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model = ElasticModel::springs_volumes);

/// The same of several materials. Edges and faces stand for volume on both sides of a boundary between two: their
/// stiffness and damping are those of their parts together. Throws std::invalid_argument as `Materials::check`, too.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Materials& materials, ElasticModel model = ElasticModel::springs_volumes);

/// `make_elastic_field` of the same arguments, but while the body is far from its rest shape it is of the neo-Hookean
/// material with the same shear modulus and no resistance to changes of volume beyond that, see
/// `PotentialField::add_soft_phase`: finds back from any start, whatever the material.
PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model = ElasticModel::neo_hookean,
                                     const PhaseThresholds& thresholds = {});
PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Materials& materials, ElasticModel model = ElasticModel::neo_hookean,
                                     const PhaseThresholds& thresholds = {});

/// A thin sheet of a material: cloth, the skin of a balloon, foil. Springs on the edges, areas of the triangles, hinges
/// across the edges, as stiff on a fine mesh as on a coarse one:
///
///     K_length = 8 mu h a_e           a_e the part of the rest area that the edge stands for
///     K_area   = (lambda - mu) h A    lambda = E nu / (1 - nu²), mu = E / 2 (1 + nu): the plane Lamé parameters
///     K_hinge  = b D |e|² / (A_1 + A_2)    D = E h³ / 12 (1 - nu²), the triangles on both sides of the edge e
///
/// Springs with K = Y a_e, averaged over directions in their plane, have mu = lambda = Y/8 [N/m], hence Poisson's ratio
/// 1/3, which is the least; areas add to lambda, and are left out there. The weights of the hinges are those of Grinspun
/// et al. 2003 (Discrete Shells) and Bridson et al. 2003; bent to a cylinder of curvature c, a mesh of equal triangles,
/// rectangular or equilateral, holds D c²/2 per area, as a plate does. The rest shape need not be flat.
struct Sheet {
  Real thickness = 1e-3;  // h [m]
  Real bending = 1;       // b: flexural rigidity over that of a plate; woven cloth is below 1, and 0 is limp
};

/// Where more than two triangles meet at an edge there is a hinge between each two of them; how they are wound does not
/// matter. Throws std::invalid_argument that names the number out of range.
PotentialField make_sheet_field(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles,
                                const Material& material, const Sheet& sheet);

}  // namespace penalty
