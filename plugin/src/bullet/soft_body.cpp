#include "penalty/bullet/soft_body.h"

#include <BulletSoftBody/btSoftBody.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

void check(const Eigen::Matrix3Xd& vertices, const SoftBodyOptions& options) {
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string("soft body: ") + name + " is " + to_text(value) + ", must be " + range);
  };
  require(options.mass > 0 && std::isfinite(options.mass), "mass", options.mass, "positive and finite [kg]");
  require(options.margin >= 0 && std::isfinite(options.margin), "margin", options.margin, "zero or positive [m]");
  require(options.friction >= 0 && std::isfinite(options.friction), "friction", options.friction, "zero or positive");
  const auto num_vertices = static_cast<int>(vertices.cols());
  if (num_vertices == 0) throw std::invalid_argument("soft body: the mesh has no vertices");
  for (const int node : options.pinned)
    if (node < 0 || node >= num_vertices)
      throw std::invalid_argument("soft body: pinned node " + std::to_string(node) + " is outside the " +
                                  std::to_string(num_vertices) + " vertices");
}

/// Equal masses, or each element's share of `options.mass`, by its size, divided among its nodes. `element` is the word for
/// one in messages.
template <std::size_t N>
std::vector<Real> node_masses(int num_vertices, const std::vector<std::array<int, N>>& elements,
                              const std::vector<Real>& sizes, const char* element, const SoftBodyOptions& options) {
  if (options.equal_masses)
    return std::vector<Real>(static_cast<std::size_t>(num_vertices), options.mass / static_cast<Real>(num_vertices));
  std::vector<Real> masses(static_cast<std::size_t>(num_vertices), 0);
  Real total = 0;
  for (std::size_t e = 0; e < sizes.size(); ++e) {
    total += std::abs(sizes[e]);
    for (const int node : elements[e]) masses[node] += std::abs(sizes[e]) / N;
  }
  for (std::size_t i = 0; i < masses.size(); ++i) {
    masses[i] *= options.mass / total;
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
  body->getCollisionShape()->setMargin(static_cast<btScalar>(options.margin));
  body->m_cfg.kDF = static_cast<btScalar>(options.friction);
  body->m_cfg.collisions = options.stock_deformable ? btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN
                                                    : btSoftBody::fCollision::SDF_RS;
  return body;
}

}  // namespace

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const SoftBodyOptions& options) {
  check(mesh.vertices, options);
  return assemble(world_info, mesh.vertices, boundary_faces(mesh.tetrahedra),
                  options.stock_deformable ? edges_of(mesh.tetrahedra) : std::vector<Edge>{},
                  node_masses(static_cast<int>(mesh.vertices.cols()), mesh.tetrahedra,
                              signed_volumes(mesh.vertices, mesh.tetrahedra), "tetrahedron", options),
                  options);
}

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TriangleSurface& surface,
                                           const SoftBodyOptions& options) {
  check(surface.vertices, options);
  const auto num_vertices = static_cast<int>(surface.vertices.cols());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (const int node : surface.triangles[t])
      if (node < 0 || node >= num_vertices)
        throw std::invalid_argument("soft body: triangle " + std::to_string(t) + ": vertex index " +
                                    std::to_string(node) + " is outside the " + std::to_string(num_vertices) +
                                    " vertices");
  return assemble(
      world_info, surface.vertices, surface.triangles,
      options.stock_deformable ? edges_of(surface.triangles) : std::vector<Edge>{},
      node_masses(num_vertices, surface.triangles, areas_of(surface.vertices, surface.triangles), "triangle", options),
      options);
}

}  // namespace penalty
