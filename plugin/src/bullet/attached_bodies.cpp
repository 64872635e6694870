#include "penalty/bullet/attached_bodies.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "attached_world.h"
#include "convert.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

void check_contact_points(const std::vector<ContactPoint>& points, int num_particles) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto fail = [&](const std::string& what) {
      throw std::invalid_argument("attach: contact point " + std::to_string(k) + ": " + what);
    };
    const ContactPoint& point = points[k];
    if (point.num_particles < 1 || point.num_particles > 4)
      fail("has " + std::to_string(point.num_particles) + " particles, must have 1 to 4");
    Real sum = 0;
    for (int i = 0; i < point.num_particles; ++i) {
      if (point.particles[i] < 0 || point.particles[i] >= num_particles)
        fail("index " + std::to_string(point.particles[i]) + " is outside the " + std::to_string(num_particles) +
             " nodes");
      sum += point.weights[i];
    }
    if (!(std::abs(sum - 1) < 1e-6)) fail("weights sum to " + to_text(sum) + ", must sum to 1");
  }
}

}  // namespace

AttachedBody::AttachedBody(btSoftBody& soft_body, PotentialField potential_field, const AttachOptions& attach_options)
    : body(&soft_body), field(std::move(potential_field)), options(attach_options) {
  const int size = soft_body.m_nodes.size();
  stepped.potential = &field;
  stepped.options = options.step;
  Particles& particles = stepped.particles;
  particles.positions = PackedVectors::Zero(4, size);
  particles.velocities = PackedVectors::Zero(4, size);
  particles.inverse_masses.resize(size);
  written_positions.resize(size);
  written_velocities.resize(size);
  read_inverse_masses.resize(size);
  for (int i = 0; i < size; ++i) {
    const btSoftBody::Node& node = soft_body.m_nodes[i];
    particles.positions.col(i).head<3>() = to_vector(node.m_x);
    particles.velocities.col(i).head<3>() = to_vector(node.m_v);
    particles.inverse_masses[i] = node.m_im;
    read_inverse_masses[i] = node.m_im;
    remember(i);
  }
}

void AttachedBody::read_nodes() {
  Particles& particles = stepped.particles;
  if (body->m_nodes.size() != particles.size())
    throw std::logic_error("attached soft body has " + std::to_string(body->m_nodes.size()) + " nodes, had " +
                           std::to_string(particles.size()) + " when it was attached");
  bool moved = false;
  rejected_particle = -1;
  for (int i = 0; i < particles.size(); ++i) {
    btSoftBody::Node& node = body->m_nodes[i];
    const btVector3 dx = node.m_x - written_positions[i], dv = node.m_v - written_velocities[i];
    if (!std::isfinite(dx.length2()) || !std::isfinite(dv.length2())) {
      rejected_particle = i;
      node.m_x = written_positions[i];
      node.m_v = written_velocities[i];
      continue;
    }
    if (!dx.isZero()) {
      particles.positions.col(i).head<3>() += to_vector(dx);
      moved = true;
    }
    if (!dv.isZero()) particles.velocities.col(i).head<3>() += to_vector(dv);
    if (node.m_im != read_inverse_masses[i]) {
      stale = stale || node.m_im > read_inverse_masses[i];  // heavier particles only leave the estimate too high
      read_inverse_masses[i] = node.m_im;
      particles.inverse_masses[i] = node.m_im;
    }
    remember(i);
  }
  if (moved) stepped.positions_changed();
}

void AttachedBody::read_forces() {
  const int size = stepped.particles.size();
  bool any = false;
  for (int i = 0; i < size; ++i) {
    btVector3& force = body->m_nodes[i].m_f;
    if (!std::isfinite(force.x()) || !std::isfinite(force.y()) || !std::isfinite(force.z())) {
      rejected_particle = i;
      force.setZero();
    }
    any = any || !force.isZero();
  }
  if (!any && stepped.external_forces.size() == 0) return;
  stepped.positions_changed();
  if (!any) {
    stepped.external_forces.resize(4, 0);
    return;
  }
  stepped.external_forces.setZero(4, size);
  for (int i = 0; i < size; ++i) {
    stepped.external_forces.col(i).head<3>() = to_vector(body->m_nodes[i].m_f);
    body->m_nodes[i].m_f.setZero();
  }
}

AttachedBodies::AttachedBodies() : attached_(std::make_unique<World>()) {}
AttachedBodies::~AttachedBodies() = default;

void AttachedBodies::attach(btSoftBody& body, PotentialField field, const AttachOptions& options) {
  attached_->attach(body, std::move(field), options);
}
void AttachedBodies::detach(const btSoftBody& body) { attached_->detach(body); }
bool AttachedBodies::is_attached(const btSoftBody& body) const { return attached_->find(body) != nullptr; }
const Particles& AttachedBodies::particles(const btSoftBody& body) const {
  return attached_->get(body).stepped.particles;
}
const PotentialField& AttachedBodies::field(const btSoftBody& body) const { return attached_->get(body).field; }
const StepReport& AttachedBodies::report(const btSoftBody& body) const { return attached_->get(body).stepped.report; }
const EnergyFlows& AttachedBodies::flows(const btSoftBody& body) const { return attached_->get(body).stepped.flows; }
std::vector<LedgerEntry> AttachedBodies::ledger(const btSoftBody& body) const {
  std::vector<LedgerEntry> entries;
  field(body).append_ledger(particles(body).positions, entries);
  return entries;
}
PackedVectors AttachedBodies::forces(const btSoftBody& body) const {
  PackedVectors forces = PackedVectors::Zero(4, particles(body).size());
  field(body).add_forces(particles(body).positions, forces);
  return forces;
}
PotentialField& AttachedBodies::edit(const btSoftBody& body) {
  AttachedBody& attached = attached_->get(body);
  attached.body->activate(true);
  attached.stepped.positions_changed();
  return attached.field;
}
int AttachedBodies::couple(std::vector<CouplingPoint> points, PotentialField field, Real damping_time) {
  return attached_->couple(std::move(points), std::move(field), damping_time);
}
void AttachedBodies::uncouple(int coupling) { attached_->uncouple(coupling); }
const PotentialField& AttachedBodies::coupling_field(int coupling) const { return attached_->coupling(coupling).field; }
PotentialField& AttachedBodies::edit_coupling(int coupling) {
  AttachedCoupling& attached = attached_->coupling(coupling);
  attached_->wake(attached);
  return attached.field;
}
Real AttachedBodies::coupling_energy(int coupling) const {
  return attached_->coupling(coupling).stepped.elastic_energy;
}
void AttachedBodies::refresh(const btSoftBody& body) {
  attached_->get(body).stale = true;
  attached_->get(body).stepped.positions_changed();
}
void AttachedBodies::synchronize(const btSoftBody& body) { attached_->get(body).read_nodes(); }

AttachedBody* AttachedBodies::World::find(const btSoftBody& body) {
  const auto found = bodies_.find(&body);
  return found == bodies_.end() ? nullptr : found->second.get();
}

AttachedBody& AttachedBodies::World::get(const btSoftBody& body) {
  if (AttachedBody* attached = find(body)) return *attached;
  throw std::invalid_argument("soft body is not attached");
}

void AttachedBodies::World::attach(btSoftBody& body, PotentialField field, const AttachOptions& options) {
  if (field.num_particles() != body.m_nodes.size())
    throw std::invalid_argument("attach: the field has " + std::to_string(field.num_particles()) +
                                " particles, the soft body " + std::to_string(body.m_nodes.size()) + " nodes");
  if (!body.getWorldInfo() || !body.getWorldInfo()->m_broadphase)
    throw std::invalid_argument("attach: the soft body's world info has no broadphase: use that of the world");
  options.step.check();
  check_contact_points(options.contact_points, field.num_particles());
  if (AttachedBody* attached = find(body)) {
    attached->field.add(std::make_unique<PotentialField>(std::move(field)));
    attached->options = options;
    attached->stepped.options = options.step;
    attached->stale = true;
    attached->stepped.positions_changed();
  } else {
    bodies_.emplace(&body, std::make_unique<AttachedBody>(body, std::move(field), options));
  }
}

void AttachedBodies::World::detach(const btSoftBody& body) {
  for (const auto& coupling : couplings_)
    if (coupling->holds(body)) wake(*coupling);
  std::erase_if(couplings_, [&](const auto& coupling) { return coupling->holds(body); });
  bodies_.erase(&body);
}

}  // namespace penalty
