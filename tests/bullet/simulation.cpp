#include "bullet/simulation.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <algorithm>

#include "penalty/bullet/penalty_deformable_body_solver.h"
#include "penalty/bullet/penalty_soft_body_solver.h"

namespace penalty::testing {

std::string world_name(WorldKind kind) {
  return std::string(kind == WorldKind::classic ? "classic" : "deformable") + (double_bullet ? "_float64" : "_float");
}

struct Simulation::Parts {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver rigid_solver;
  btDeformableMultiBodyConstraintSolver multi_body_solver;
  std::unique_ptr<btSoftBodySolver> soft_solver;
};

Simulation::Simulation(WorldKind kind, Solver solver) : parts_(std::make_unique<Parts>()), kind_(kind) {
  const auto keep = [&]<class SoftSolver>(std::unique_ptr<SoftSolver> made) {
    SoftSolver* pointer = made.get();
    if constexpr (std::is_base_of_v<AttachedBodies, SoftSolver>) penalty_ = pointer;
    parts_->soft_solver = std::move(made);
    return pointer;
  };
  Parts& p = *parts_;
  if (kind == WorldKind::classic) {
    btSoftBodySolver* soft = solver == Solver::penalty
                                 ? static_cast<btSoftBodySolver*>(keep(std::make_unique<PenaltySoftBodySolver>()))
                                 : keep(std::make_unique<btDefaultSoftBodySolver>());
    world_ = std::make_unique<btSoftRigidDynamicsWorld>(&p.dispatcher, &p.broadphase, &p.rigid_solver, &p.configuration,
                                                        soft);
  } else {
    btDeformableBodySolver* soft = solver == Solver::penalty ? keep(std::make_unique<PenaltyDeformableBodySolver>())
                                                             : keep(std::make_unique<btDeformableBodySolver>());
    p.multi_body_solver.setDeformableSolver(soft);
    world_ = std::make_unique<btDeformableMultiBodyDynamicsWorld>(&p.dispatcher, &p.broadphase, &p.multi_body_solver,
                                                                  &p.configuration, soft);
  }
  info().m_maxDisplacement = 1000;
  info().m_sparsesdf.setDefaultVoxelsz(static_cast<btScalar>(0.05));
  set_gravity({0, 0, 0});
}

Simulation::~Simulation() {
  while (!soft_bodies_.empty()) remove(*soft_bodies_.back());
  while (!rigid_bodies_.empty()) remove(*rigid_bodies_.back());
}

btDeformableMultiBodyDynamicsWorld& Simulation::deformable_world() {
  return dynamic_cast<btDeformableMultiBodyDynamicsWorld&>(*world_);
}

btSoftBodyWorldInfo& Simulation::info() {
  return kind_ == WorldKind::classic ? dynamic_cast<btSoftRigidDynamicsWorld&>(*world_).getWorldInfo()
                                     : deformable_world().getWorldInfo();
}

void Simulation::set_gravity(const Vector3& gravity) {
  world_->setGravity(to_bullet(gravity));
  info().m_gravity = to_bullet(gravity);
}

btSoftBody& Simulation::add(std::unique_ptr<btSoftBody> body) {
  body->setActivationState(DISABLE_DEACTIVATION);
  if (kind_ == WorldKind::classic)
    dynamic_cast<btSoftRigidDynamicsWorld&>(*world_).addSoftBody(body.get());
  else
    deformable_world().addSoftBody(body.get());
  soft_bodies_.push_back(std::move(body));
  return *soft_bodies_.back();
}

btSoftBody& Simulation::add_jelly(const TetMesh& mesh, const JellyOptions& options) {
  btSoftBody& body = add(make_soft_body(info(), moved(mesh, options.shift), options.body));
  penalty_->attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, options.stiffness), options.attach);
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
  world_->addRigidBody(body.get());
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
  if (kind_ == WorldKind::classic)
    dynamic_cast<btSoftRigidDynamicsWorld&>(*world_).removeSoftBody(&body);
  else
    deformable_world().removeSoftBody(&body);
  const auto found =
      std::find_if(soft_bodies_.begin(), soft_bodies_.end(), [&](const auto& b) { return b.get() == &body; });
  std::unique_ptr<btSoftBody> taken = std::move(*found);
  soft_bodies_.erase(found);
  return taken;
}

void Simulation::remove(btSoftBody& body) {
  if (penalty_) penalty_->detach(body);
  take_out(body);
}

void Simulation::remove(btRigidBody& body) {
  world_->removeRigidBody(&body);
  std::erase_if(rigid_bodies_, [&](const auto& b) { return b.get() == &body; });
}

void Simulation::step(Real duration, int count) {
  for (int k = 0; k < count; ++k) world_->stepSimulation(static_cast<btScalar>(duration), 0);
}

Totals Simulation::totals() const {
  Totals sum;
  const Vector3 gravity = to_vector(world_->getGravity());
  for (const auto& body : soft_bodies_) {
    if (!penalty_ || !penalty_->is_attached(*body)) continue;
    const Particles& particles = penalty_->particles(*body);
    sum.momentum += linear_momentum(particles);
    sum.angular_momentum += angular_momentum(particles);
    sum.energy += kinetic_energy(particles) + penalty_->field(*body).energy(particles.positions);
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

Real lowest(const btSoftBody& body) {
  Real y = Real(body.m_nodes[0].m_x.y());
  for (int i = 1; i < body.m_nodes.size(); ++i) y = std::min(y, Real(body.m_nodes[i].m_x.y()));
  return y;
}

Real mean_volume_error(const AttachedBodies& penalty, const btSoftBody& body) {
  std::vector<Real> values;
  penalty.field(body).find<TetrahedronVolume>()->append_strains(penalty.particles(body).positions, values);
  Real sum = 0;
  for (const Real value : values) sum += std::abs(value);
  return sum / static_cast<Real>(values.size());
}

TetMesh moved(TetMesh mesh, const Vector3& shift) {
  mesh.vertices.colwise() += shift;
  return mesh;
}

}  // namespace penalty::testing
