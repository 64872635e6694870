#include "bullet/simulation.h"

#include <algorithm>

void penalty::demo::PrintTo(WorldKind kind, std::ostream* out) { *out << testing::world_name(kind); }

namespace penalty::testing {

Matrix3 turned(Real angle, const Vector3& axis) {
  return Eigen::AngleAxis<Real>(angle, axis.normalized()).toRotationMatrix();
}

Real box_distance(const Vector3& point, const Vector3& half_extents) {
  const Vector3 beyond = point.cwiseAbs() - half_extents;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), Real(0));
}

std::string world_name(WorldKind kind) {
  return std::string(kind == WorldKind::classic ? "classic" : "deformable") + (double_bullet ? "_float64" : "_float");
}

Simulation::Simulation(WorldKind kind, Solver solver) : world_(kind, solver) {
  info().m_maxDisplacement = 1000;
  info().m_sparsesdf.setDefaultVoxelsz(static_cast<btScalar>(0.05));
  set_gravity({0, 0, 0});
}

Simulation::~Simulation() {
  while (!soft_bodies_.empty()) remove(*soft_bodies_.back());
  while (!rigid_bodies_.empty()) remove(*rigid_bodies_.back());
}

btSoftBody& Simulation::add(std::unique_ptr<btSoftBody> body) {
  body->setActivationState(DISABLE_DEACTIVATION);
  world_.add(*body);
  soft_bodies_.push_back(std::move(body));
  return *soft_bodies_.back();
}

btSoftBody& Simulation::add_jelly(const TetMesh& mesh, const JellyOptions& options) {
  btSoftBody& body = add(make_soft_body(info(), moved(mesh, options.shift), options.body));
  penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, options.stiffness), options.attach);
  return body;
}

btRigidBody& Simulation::add_rigid(std::unique_ptr<btCollisionShape> shape, Real mass, const Vector3& position,
                                   const Matrix3& rotation) {
  const auto m = static_cast<btScalar>(mass);
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(m, inertia);
  btRigidBody::btRigidBodyConstructionInfo construction(m, nullptr, shape.get(), inertia);
  const Eigen::Quaternion<Real> q(rotation);
  construction.m_startWorldTransform.setIdentity();
  construction.m_startWorldTransform.setOrigin(to_bullet(position));
  construction.m_startWorldTransform.setRotation({static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                                  static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())});
  auto body = std::make_unique<btRigidBody>(construction);
  body->setActivationState(DISABLE_DEACTIVATION);
  world().addRigidBody(body.get());
  shapes_.push_back(std::move(shape));
  rigid_bodies_.push_back(std::move(body));
  return *rigid_bodies_.back();
}

btRigidBody& Simulation::add_box(const Vector3& half_extents, Real mass, const Vector3& position,
                                 const Matrix3& rotation) {
  return add_rigid(std::make_unique<btBoxShape>(to_bullet(half_extents)), mass, position, rotation);
}

btRigidBody& Simulation::add_ground(Real friction) {
  btRigidBody& ground = add_box({20, 0.5, 20}, 0, {0, -0.5, 0});
  ground.setFriction(static_cast<btScalar>(friction));
  return ground;
}

std::unique_ptr<btSoftBody> Simulation::take_out(btSoftBody& body) {
  world_.remove(body);
  const auto found =
      std::find_if(soft_bodies_.begin(), soft_bodies_.end(), [&](const auto& b) { return b.get() == &body; });
  std::unique_ptr<btSoftBody> taken = std::move(*found);
  soft_bodies_.erase(found);
  return taken;
}

void Simulation::remove(btSoftBody& body) {
  if (world_.has_plugin()) penalty().detach(body);
  take_out(body);
}

void Simulation::remove(btRigidBody& body) {
  world().removeRigidBody(&body);
  std::erase_if(rigid_bodies_, [&](const auto& b) { return b.get() == &body; });
}

void Simulation::step(Real duration, int count) {
  for (int k = 0; k < count; ++k) world_.step(duration);
}

Totals Simulation::totals() {
  Totals sum;
  const Vector3 gravity = to_vector(world().getGravity());
  for (const auto& body : soft_bodies_) {
    if (!world_.has_plugin() || !penalty().is_attached(*body)) continue;
    const Particles& particles = penalty().particles(*body);
    sum.momentum += linear_momentum(particles);
    sum.angular_momentum += angular_momentum(particles);
    sum.energy += kinetic_energy(particles) + penalty().field(*body).energy(particles.positions);
    for (int i = 0; i < particles.size(); ++i)
      if (particles.inverse_masses[i] > 0)
        sum.energy -= gravity.dot(particles.positions.col(i).head<3>()) / particles.inverse_masses[i];
  }
  for (const auto& body : rigid_bodies_) {
    if (body->isStaticOrKinematicObject()) continue;
    const Real mass = 1 / Real(body->getInvMass());
    const Vector3 x = to_vector(body->getWorldTransform().getOrigin()), v = to_vector(body->getLinearVelocity());
    const Vector3 w = to_vector(body->getAngularVelocity());
    const Matrix3 rotation = to_matrix(body->getWorldTransform().getBasis());
    const Vector3 spin =
        rotation * to_vector(body->getInvInertiaDiagLocal()).cwiseInverse().asDiagonal() * rotation.transpose() * w;
    sum.momentum += mass * v;
    sum.angular_momentum += mass * x.cross(v) + spin;
    sum.energy += mass * v.squaredNorm() / 2 + w.dot(spin) / 2 - mass * gravity.dot(x);
  }
  return sum;
}

void let_sleep(btCollisionObject& object) { object.forceActivationState(ACTIVE_TAG); }

Vector3 center_of_mass(const Particles& particles) {
  Vector3 sum = Vector3::Zero();
  Real mass = 0;
  for (int i = 0; i < particles.size(); ++i) {
    if (particles.inverse_masses[i] == 0) continue;
    sum += particles.positions.col(i).head<3>() / particles.inverse_masses[i];
    mass += 1 / particles.inverse_masses[i];
  }
  return sum / mass;
}

std::vector<Vector3> places_of(const btSoftBody& body) {
  std::vector<Vector3> places;
  places.reserve(body.m_nodes.size());
  for (int i = 0; i < body.m_nodes.size(); ++i) places.push_back(to_vector(body.m_nodes[i].m_x));
  return places;
}

Real lowest(const btSoftBody& body) {
  Real y = Real(body.m_nodes[0].m_x.y());
  for (int i = 1; i < body.m_nodes.size(); ++i) y = std::min(y, Real(body.m_nodes[i].m_x.y()));
  return y;
}

Real mean_volume_error(const AttachedBodies& penalty, const btSoftBody& body) {
  const std::vector<Real> values =
      strains(penalty.field(body).batch<TetrahedronVolume>(), penalty.particles(body).positions);
  Real sum = 0;
  for (const Real value : values) sum += std::abs(value);
  return sum / static_cast<Real>(values.size());
}

TetMesh moved(TetMesh mesh, const Vector3& shift) {
  mesh.vertices.colwise() += shift;
  return mesh;
}

}  // namespace penalty::testing
