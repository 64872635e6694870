#include "penalty/fields/elastic_field.h"

#include <algorithm>
#include <cmath>

namespace penalty {
namespace {

std::vector<Real> scaled(std::vector<Real> shares, Real density) {
  for (Real& share : shares) share *= density;
  return shares;
}

Materials throughout(const Material& material, std::size_t tetrahedra) {
  return {.kinds = {material}, .kind_of = std::vector<int>(tetrahedra, 0)};
}

std::vector<Real> volumes_at_rest(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra) {
  std::vector<Real> volumes = signed_volumes(vertices, tetrahedra);
  for (std::size_t t = 0; t < volumes.size(); ++t) {
    volumes[t] = std::abs(volumes[t]);
    if (!(volumes[t] > 0))
      throw std::invalid_argument("elastic field: tetrahedron " + std::to_string(t) + " has no volume at rest");
  }
  return volumes;
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

void Materials::check(std::size_t tetrahedra, ElasticModel model) const {
  if (kind_of.size() != tetrahedra)
    throw std::invalid_argument("materials: they are those of " + std::to_string(kind_of.size()) +
                                " tetrahedra, not of " + std::to_string(tetrahedra));
  for (std::size_t t = 0; t < tetrahedra; ++t)
    if (kind_of[t] < 0 || static_cast<std::size_t>(kind_of[t]) >= kinds.size())
      throw std::invalid_argument("materials: tetrahedron " + std::to_string(t) + " is of material " +
                                  std::to_string(kind_of[t]) + ", there are " + std::to_string(kinds.size()));
  for (std::size_t k = 0; k < kinds.size(); ++k) try {
      kinds[k].check(model);
    } catch (const std::invalid_argument& error) {
      if (kinds.size() == 1) throw;
      throw std::invalid_argument("material " + std::to_string(k) + std::string(error.what()).substr(8));  // "material"
    }
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness) {
  PotentialField field(vertices);
  field.add<Length>(edges_of(tetrahedra), stiffness);
  field.add<TetrahedronVolume>(tetrahedra, stiffness);
  return field;
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model) {
  return make_elastic_field(vertices, tetrahedra, throughout(material, tetrahedra.size()), model);
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Materials& materials, ElasticModel model) {
  materials.check(tetrahedra.size(), model);
  PotentialField field(vertices);
  const std::vector<Real> volumes = volumes_at_rest(vertices, tetrahedra);
  const bool damps =
      std::any_of(materials.kinds.begin(), materials.kinds.end(), [](const Material& m) { return m.damping > 0; });
  // Adds a batch. A tetrahedron brings `density(its material)` times its volume to the stiffness of the elements that
  // `share` divides it among, and its damping with that.
  const auto add = [&](const auto& density, const auto& share, const auto& add_batch) {
    std::vector<Real> parts;
    parts.reserve(volumes.size());
    for (std::size_t t = 0; t < volumes.size(); ++t) parts.push_back(density(materials.of(t)) * volumes[t]);
    const std::vector<Real> stiffnesses = share(parts);
    ElementBatch& batch = add_batch(stiffnesses);
    if (!damps) return;
    for (std::size_t t = 0; t < volumes.size(); ++t) parts[t] *= materials.of(t).damping;
    const std::vector<Real> damped = share(parts);
    for (std::size_t e = 0; e < damped.size(); ++e)
      if (damped[e] > 0) batch.set_damping_time(static_cast<int>(e), damped[e] / stiffnesses[e]);
  };
  const auto as_they_are = [](std::vector<Real> parts) { return parts; };

  if (model == ElasticModel::neo_hookean) {
    std::vector<StableNeoHookean> prototypes;
    prototypes.reserve(volumes.size());
    for (std::size_t t = 0; t < volumes.size(); ++t)
      prototypes.push_back(StableNeoHookean::with_ratio(materials.of(t).lame_lambda() / materials.of(t).lame_mu()));
    add([](const Material& m) { return m.lame_mu(); }, as_they_are,
        [&](const auto& k) -> ElementBatch& { return field.add<StableNeoHookean>(prototypes, tetrahedra, k); });
    return field;
  }
  const std::vector<Edge> edges = edges_of(tetrahedra);
  add([&](const Material& m) { return m.length_stiffness_density(model); },
      [&](const std::vector<Real>& parts) { return edge_volume_shares(edges, tetrahedra, parts); },
      [&](const auto& k) -> ElementBatch& { return field.add<Length>(edges, k); });
  if (model == ElasticModel::springs_areas_volumes) {
    const std::vector<Triangle> faces = faces_of(tetrahedra);
    add([&](const Material& m) { return m.area_stiffness_density(model); },
        [&](const std::vector<Real>& parts) { return face_volume_shares(faces, tetrahedra, parts); },
        [&](const auto& k) -> ElementBatch& { return field.add<TriangleArea>(faces, k); });
  }
  // The least Poisson ratio, computed in floating point, may leave a volume term of either sign in the last digits.
  std::vector<std::size_t> resisting;
  std::vector<Tetrahedron> stencils;
  for (std::size_t t = 0; t < volumes.size(); ++t)
    if (materials.of(t).volume_stiffness_density(model) > 1e-12 * materials.of(t).young) {
      resisting.push_back(t);
      stencils.push_back(tetrahedra[t]);
    }
  if (!resisting.empty())
    add([&](const Material& m) { return m.volume_stiffness_density(model); },
        [&](const std::vector<Real>& parts) {
          std::vector<Real> kept;
          kept.reserve(resisting.size());
          for (const std::size_t t : resisting) kept.push_back(parts[t]);
          return kept;
        },
        [&](const auto& k) -> ElementBatch& { return field.add<TetrahedronVolume>(stencils, k); });
  return field;
}

PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model, const PhaseThresholds& thresholds) {
  return make_recovering_field(vertices, tetrahedra, throughout(material, tetrahedra.size()), model, thresholds);
}

PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Materials& materials, ElasticModel model,
                                     const PhaseThresholds& thresholds) {
  PotentialField field = make_elastic_field(vertices, tetrahedra, materials, model);
  Materials soft = materials;
  for (Material& material : soft.kinds) {  // mu = E / 2 (1 + nu) stays; without lambda nu is 0
    material.young = 2 * material.lame_mu();
    material.poisson = 0;
  }
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
