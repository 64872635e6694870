#include "penalty/bullet/soft_body.h"

#include <BulletSoftBody/btSoftBody.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

void check(const TetMesh& mesh, const SoftBodyOptions& options) {
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string("soft body: ") + name + " is " + to_text(value) + ", must be " +
                                  range);
  };
  require(options.mass > 0 && std::isfinite(options.mass), "mass", options.mass, "positive and finite [kg]");
  require(options.margin >= 0 && std::isfinite(options.margin), "margin", options.margin, "zero or positive [m]");
  require(options.friction >= 0 && std::isfinite(options.friction), "friction", options.friction, "zero or positive");
  const auto num_vertices = static_cast<int>(mesh.vertices.cols());
  if (num_vertices == 0) throw std::invalid_argument("soft body: the mesh has no vertices");
  for (const int node : options.pinned)
    if (node < 0 || node >= num_vertices)
      throw std::invalid_argument("soft body: pinned node " + std::to_string(node) + " is outside the " +
                                  std::to_string(num_vertices) + " vertices");
}

std::vector<Real> node_masses(const TetMesh& mesh, const SoftBodyOptions& options) {
  const auto num_vertices = static_cast<std::size_t>(mesh.vertices.cols());
  if (options.equal_masses) return std::vector<Real>(num_vertices, options.mass / static_cast<Real>(num_vertices));
  const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
  std::vector<Real> masses(num_vertices, 0);
  Real total = 0;
  for (std::size_t t = 0; t < volumes.size(); ++t) {
    total += std::abs(volumes[t]);
    for (const int node : mesh.tetrahedra[t]) masses[node] += std::abs(volumes[t]) / 4;
  }
  for (std::size_t i = 0; i < masses.size(); ++i) {
    masses[i] *= options.mass / total;
    if (!(masses[i] > 0))
      throw std::invalid_argument("soft body: node " + std::to_string(i) + " has mass " + to_text(masses[i]) +
                                  " kg: no tetrahedron of the mesh holds it");
  }
  return masses;
}

}  // namespace

std::unique_ptr<btSoftBody> make_soft_body(btSoftBodyWorldInfo& world_info, const TetMesh& mesh,
                                           const SoftBodyOptions& options) {
  check(mesh, options);
  std::vector<Real> masses = node_masses(mesh, options);
  for (const int node : options.pinned) masses[node] = 0;

  btAlignedObjectArray<btVector3> positions;
  btAlignedObjectArray<btScalar> bullet_masses;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    positions.push_back(to_bullet(mesh.vertices.col(static_cast<Eigen::Index>(i))));
    bullet_masses.push_back(static_cast<btScalar>(masses[i]));
  }
  auto body = std::make_unique<btSoftBody>(&world_info, positions.size(), &positions[0], &bullet_masses[0]);
  for (const auto& [a, b, c] : boundary_faces(mesh.tetrahedra)) body->appendFace(a, b, c);
  if (options.stock_deformable)
    for (const auto& [a, b] : edges_of(mesh.tetrahedra)) body->appendLink(a, b);
  body->getCollisionShape()->setMargin(static_cast<btScalar>(options.margin));
  body->m_cfg.kDF = static_cast<btScalar>(options.friction);
  body->m_cfg.collisions = options.stock_deformable ? btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN
                                                    : btSoftBody::fCollision::SDF_RS;
  return body;
}

}  // namespace penalty
