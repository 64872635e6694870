#include "penalty/bullet/soft_body.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "face_tree.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

Real mass_of(const SoftBodyOptions& options) { return options.mass.value_or(1); }

Real margin_of(const SoftBodyOptions& options, const Eigen::Matrix3Xd& vertices) {
  constexpr Real of_a_metre = 0.02;
  if (options.margin || vertices.cols() == 0) return options.margin.value_or(of_a_metre);
  const Real size = (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).maxCoeff();
  return size > 0 ? of_a_metre * std::min<Real>(size, 1) : of_a_metre;
}

void require(bool ok, const char* name, Real value, const char* range) {
  if (!ok)
    throw std::invalid_argument(std::string("soft body: ") + name + " is " + to_text(value) + ", must be " + range);
}

bool is_positive(Real value) { return value > 0 && std::isfinite(value); }
bool is_positive_or_zero(Real value) { return value >= 0 && std::isfinite(value); }

void check(const Eigen::Matrix3Xd& vertices, const SoftBodyOptions& options) {
  require(is_positive(mass_of(options)), "mass", mass_of(options), "positive and finite [kg]");
  if (options.margin) require(is_positive_or_zero(*options.margin), "margin", *options.margin, "zero or positive [m]");
  require(is_positive_or_zero(options.friction), "friction", options.friction, "zero or positive");
  const auto num_vertices = static_cast<int>(vertices.cols());
  if (num_vertices == 0) throw std::invalid_argument("soft body: the mesh has no vertices");
  for (const int node : options.pinned)
    if (node < 0 || node >= num_vertices)
      throw std::invalid_argument("soft body: pinned node " + std::to_string(node) + " is outside the " +
                                  std::to_string(num_vertices) + " vertices");
}

/// `element` is the word for one in messages.
template <std::size_t N>
void check_indices(const Eigen::Matrix3Xd& vertices, const std::vector<std::array<int, N>>& elements,
                   const char* element) {
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (const int node : elements[e])
      if (node < 0 || node >= vertices.cols())
        throw std::invalid_argument(std::string("soft body: ") + element + " " + std::to_string(e) + ": vertex index " +
                                    std::to_string(node) + " is outside the " + std::to_string(vertices.cols()) +
                                    " vertices");
}

/// The options with the mass that the material gives to elements of these volumes.
SoftBodyOptions with_density(SoftBodyOptions options, const Material& material, Real volume) {
  if (options.mass)
    throw std::invalid_argument("soft body: mass is " + to_text(*options.mass) +
                                " kg, but the density of the material decides: leave one of them out");
  require(is_positive(material.density), "density", material.density, "positive and finite [kg/m³]");
  require(is_positive(volume), "volume", volume, "positive and finite [m³] for a mass by density");
  options.mass = material.density * volume;
  return options;
}

Real sum_of_sizes(const std::vector<Real>& sizes) {
  Real sum = 0;
  for (const Real size : sizes) sum += std::abs(size);
  return sum;
}

/// Equal masses, or each element's share of the mass, by its size times its density relative to others, divided among
/// its nodes. With such `densities`, equal masses are times the mean around each node. `element` is the word for one in
/// messages.
template <std::size_t N>
std::vector<Real> node_masses(int num_vertices, const std::vector<std::array<int, N>>& elements,
                              const std::vector<Real>& sizes, const char* element, const SoftBodyOptions& options,
                              const std::vector<Real>& densities = {}) {
  if (options.equal_masses && densities.empty())
    return std::vector<Real>(static_cast<std::size_t>(num_vertices),
                             mass_of(options) / static_cast<Real>(num_vertices));
  std::vector<Real> masses(static_cast<std::size_t>(num_vertices), 0), shares = masses;
  for (std::size_t e = 0; e < sizes.size(); ++e)
    for (const int node : elements[e]) {
      shares[node] += std::abs(sizes[e]);
      masses[node] += std::abs(sizes[e]) * (densities.empty() ? 1 : densities[e]);
    }
  if (options.equal_masses)
    for (std::size_t i = 0; i < masses.size(); ++i) masses[i] /= shares[i];
  const Real scale = mass_of(options) / std::accumulate(masses.begin(), masses.end(), Real{0});
  for (std::size_t i = 0; i < masses.size(); ++i) {
    masses[i] *= scale;
    if (!(masses[i] > 0))
      throw std::invalid_argument("soft body: node " + std::to_string(i) + " has mass " + to_text(masses[i]) +
                                  " kg: no " + element + " of the mesh holds it");
  }
  return masses;
}

std::unique_ptr<btSoftBody> assemble(btSoftBodyWorldInfo& world_info, const Eigen::Matrix3Xd& vertices,
                                     const std::vector<Triangle>& faces, const std::vector<Edge>& links,
                                     std::vector<Real> masses, const SoftBodyOptions& options) {
  for (const int node : options.pinned) masses[node] = 0;
  btAlignedObjectArray<btVector3> positions;
  btAlignedObjectArray<btScalar> bullet_masses;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    positions.push_back(to_bullet(vertices.col(static_cast<Eigen::Index>(i))));
    bullet_masses.push_back(static_cast<btScalar>(masses[i]));
  }
  auto body = std::make_unique<btSoftBody>(&world_info, positions.size(), &positions[0], &bullet_masses[0]);
  for (const auto& [a, b, c] : faces) body->appendFace(a, b, c);
  for (const auto& [a, b] : links) body->appendLink(a, b);
  body->getCollisionShape()->setMargin(static_cast<btScalar>(margin_of(options, vertices)));
  body->m_cfg.kDF = static_cast<btScalar>(options.friction);
  body->m_cfg.collisions = options.stock_deformable ? btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN
                                                    : btSoftBody::fCollision::SDF_RS;
  keep_face_tree(*body);
  return body;
}

}  // namespace

namespace {

std::unique_ptr<btSoftBody> from_tetrahedra(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                            const SoftBodyOptions& options, const std::vector<Real>& densities = {}) {
  check(mesh.vertices, options);
  check_indices(mesh.vertices, mesh.tetrahedra, "tetrahedron");
  return assemble(world_info, mesh.vertices, boundary_faces(mesh.tetrahedra),
                  options.stock_deformable ? edges_of(mesh.tetrahedra) : std::vector<Edge>{},
                  node_masses(static_cast<int>(mesh.vertices.cols()), mesh.tetrahedra,
                              signed_volumes(mesh.vertices, mesh.tetrahedra), "tetrahedron", options, densities),
                  options);
}

}  // namespace

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const SoftBodyOptions& options) {
  return from_tetrahedra(world_info, mesh, options);
}

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const Material& material, const SoftBodyOptions& options) {
  check_indices(mesh.vertices, mesh.tetrahedra, "tetrahedron");
  const Real volume = sum_of_sizes(signed_volumes(mesh.vertices, mesh.tetrahedra));
  return make_soft_body(world_info, mesh, with_density(options, material, volume));
}

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const Materials& materials, const SoftBodyOptions& options) {
  check_indices(mesh.vertices, mesh.tetrahedra, "tetrahedron");
  materials.check(mesh.tetrahedra.size(), ElasticModel::neo_hookean);  // of all models the least particular
  const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
  std::vector<Real> densities;
  Real mass = 0;
  for (std::size_t t = 0; t < volumes.size(); ++t) {
    densities.push_back(materials.of(t).density);
    mass += densities[t] * std::abs(volumes[t]);
  }
  const Real volume = sum_of_sizes(volumes);
  const SoftBodyOptions with_mass = with_density(options, Material{.density = mass / volume}, volume);
  return from_tetrahedra(world_info, mesh, with_mass, densities);
}

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TriangleSurface& surface,
                                           const SoftBodyOptions& options) {
  check(surface.vertices, options);
  check_indices(surface.vertices, surface.triangles, "triangle");
  return assemble(world_info, surface.vertices, surface.triangles,
                  options.stock_deformable ? edges_of(surface.triangles) : std::vector<Edge>{},
                  node_masses(static_cast<int>(surface.vertices.cols()), surface.triangles,
                              areas_of(surface.vertices, surface.triangles), "triangle", options),
                  options);
}

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TriangleSurface& surface,
                                           const Material& material, Real thickness, const SoftBodyOptions& options) {
  check_indices(surface.vertices, surface.triangles, "triangle");
  require(is_positive(thickness), "thickness", thickness, "positive and finite [m]");
  const Real area = sum_of_sizes(areas_of(surface.vertices, surface.triangles));
  return make_soft_body(world_info, surface, with_density(options, material, area * thickness));
}

}  // namespace penalty
