#include "penalty/fields/elastic_field.h"

#include <algorithm>
#include <cmath>

namespace penalty {
namespace {

std::vector<Real> scaled(std::vector<Real> shares, Real density) {
  for (Real& share : shares) share *= density;
  return shares;
}

void set_damping(const PotentialField& field, Real time) {
  for (const auto& potential : field.potentials()) static_cast<ElementBatch&>(*potential).set_damping_time(time);
}

// As hinges_of, of any two triangles that share an edge.
std::vector<Hinge> folds_of(std::span<const Triangle> triangles) {
  struct Side {
    Edge edge;
    int wing;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (const auto& [a, b, c] : triangles)
    for (const auto& [p, q, wing] : {Triangle{a, b, c}, Triangle{b, c, a}, Triangle{c, a, b}})
      sides.push_back({{std::min(p, q), std::max(p, q)}, wing});
  std::sort(sides.begin(), sides.end(),
            [](const Side& l, const Side& r) { return l.edge != r.edge ? l.edge < r.edge : l.wing < r.wing; });
  std::vector<Hinge> folds;
  for (auto left = sides.begin(); left != sides.end(); ++left)
    for (auto right = left + 1; right != sides.end() && right->edge == left->edge; ++right)
      if (right->wing != left->wing) folds.push_back({left->edge[0], left->edge[1], left->wing, right->wing});
  return folds;
}

}  // namespace

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
  for (std::size_t t = 0; t < volumes.size(); ++t) {
    volumes[t] = std::abs(volumes[t]);
    if (!(volumes[t] > 0))
      throw std::invalid_argument("elastic field: tetrahedron " + std::to_string(t) + " has no volume at rest");
  }
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
  if (material.damping > 0) set_damping(field, material.damping);
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

PotentialField make_sheet_field(const Eigen::Matrix3Xd& vertices, std::span<const Triangle> triangles,
                                const Material& material, const Sheet& sheet) {
  constexpr Real least_poisson = 1.0 / 3;
  material.check(least_poisson, "sheets");
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string("sheet: ") + name + " is " + to_text(value) + ", must be " + range);
  };
  require(sheet.thickness > 0 && std::isfinite(sheet.thickness), "thickness", sheet.thickness,
          "positive and finite [m]");
  require(sheet.bending >= 0 && std::isfinite(sheet.bending), "bending", sheet.bending, "zero or positive, and finite");

  PotentialField field(vertices);
  const Real nu = material.poisson, h = sheet.thickness, plane_young = material.young / (1 - nu * nu),
             mu = material.lame_mu(), lambda = plane_young * nu;
  const std::vector<Real> areas = areas_of(vertices, triangles);
  const std::vector<Edge> edges = edges_of(triangles);
  field.add<Length>(edges, scaled(edge_area_shares(edges, triangles, areas), 8 * mu * h));
  if (nu > least_poisson * (1 + 1e-9)) field.add<TriangleArea>(triangles, scaled(areas, (lambda - mu) * h));
  if (sheet.bending > 0) {
    const Real rigidity = sheet.bending * plane_young * h * h * h / 12;
    const std::vector<Hinge> hinges = folds_of(triangles);
    std::vector<Real> stiffnesses;
    stiffnesses.reserve(hinges.size());
    for (const auto& [a, b, left, right] : hinges) {
      const Vector3 edge = vertices.col(b) - vertices.col(a);
      const Real twice_areas = edge.cross(vertices.col(left) - vertices.col(a)).norm() +
                               edge.cross(vertices.col(right) - vertices.col(a)).norm();
      stiffnesses.push_back(2 * rigidity * edge.squaredNorm() / twice_areas);
    }
    field.add<BendingAngle>(hinges, stiffnesses);
  }
  if (material.damping > 0) set_damping(field, material.damping);
  return field;
}

}  // namespace penalty
