#include "penalty/bullet/attached_bodies.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "body_settings.h"
#include "convert.h"
#include "face_tree.h"
#include "penalty/math/text.h"
#include "world_step.h"

namespace penalty {
namespace {

constexpr Real least_weight = 1e-6;  // round-off of points on a face

void check_points(const std::vector<WeightedPoint>& points, int num_particles, const char* which) {
  for (std::size_t k = 0; k < points.size(); ++k)
    points[k].check(num_particles, std::string("attach: ") + which + " point " + std::to_string(k));
}

Vector3 center_of_mass(const btCollisionObject& object) {
  const btSoftBody* soft = btSoftBody::upcast(&object);
  Vector3 sum = Vector3::Zero();
  Real mass = 0;
  for (int i = 0; soft && i < soft->m_nodes.size(); ++i)
    if (const Real inverse_mass = soft->m_nodes[i].m_im; inverse_mass > 0) {
      sum += to_vector(soft->m_nodes[i].m_x) / inverse_mass;
      mass += 1 / inverse_mass;
    }
  return mass > 0 ? Vector3(sum / mass) : to_vector(object.getWorldTransform().getOrigin());
}

void check_surface(const BodySurface& surface, int num_particles) {
  check_points(surface.points, num_particles, "surface");
  for (std::size_t k = 0; k < surface.points.size(); ++k)
    for (int i = 0; i < surface.points[k].size; ++i)
      if (surface.points[k].weights[i] < -least_weight)
        throw std::invalid_argument("attach: surface point " + std::to_string(k) + ": weight " +
                                    to_text(surface.points[k].weights[i]) +
                                    " is negative: it lies outside the particles that carry it");
  const std::size_t num_points = surface.points.size();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (const int point : surface.triangles[t])
      if (point < 0 || static_cast<std::size_t>(point) >= num_points)
        throw std::invalid_argument("attach: surface triangle " + std::to_string(t) + ": index " +
                                    std::to_string(point) + " is outside the " + std::to_string(num_points) +
                                    " surface points");
}

}  // namespace

bool AttachedBody::is_gone() const {
  const auto bodies = bodies_.lock();
  return !bodies || !bodies->is_there({address_, serial_number_});
}

AttachedBodies::AttachedBodies() : attached_(std::make_unique<World>()) {}
AttachedBodies::~AttachedBodies() = default;

AttachedBody AttachedBodies::attach(btSoftBody& body, PotentialField field, const AttachOptions& options) {
  if (field.num_particles() != body.m_nodes.size())
    throw std::invalid_argument("attach: the field has " + std::to_string(field.num_particles()) +
                                " particles, the soft body " + std::to_string(body.m_nodes.size()) + " nodes");
  if (!body.getWorldInfo() || !body.getWorldInfo()->m_broadphase)
    throw std::invalid_argument("attach: the soft body's world info has no broadphase: use that of the world");
  options.step.check();
  check_points(options.contact_points, field.num_particles(), "contact");
  check_surface(options.surface, field.num_particles());
  HeldBodies& bodies = *attached_->bodies;
  HeldBody* held = bodies.find(body);
  if (held) {
    held->field.add(std::move(field));
    held->options = options;
    held->surface.reset();
    held->mesh_sides.forget();
    held->stepped.options = options.step;
    held->stale = true;
    held->stepped.positions_changed();
  } else {
    held = &bodies.add(body, std::move(field), options);
  }
  keep_face_tree(body);
  return {attached_->bodies, body, held->serial, penalty::unused_settings(body, held->largest_margin)};
}

void AttachedBodies::detach(const btSoftBody& body) {
  attached_->couplings.remove_all_of(body);
  if (HeldBody* held = attached_->bodies->find(body)) held->give_faces_back();
  attached_->bodies->remove(body);
}

bool AttachedBodies::is_attached(const btSoftBody& body) const { return attached_->bodies->find(body) != nullptr; }
const Particles& AttachedBodies::particles(const btSoftBody& body) const {
  return attached_->bodies->get(body).stepped.particles;
}
const PotentialField& AttachedBodies::field(const btSoftBody& body) const { return attached_->bodies->get(body).field; }
const StepReport& AttachedBodies::report(const btSoftBody& body) const {
  return attached_->bodies->get(body).stepped.report;
}
std::span<const BodyContact> AttachedBodies::contacts(const btSoftBody& body) const {
  return attached_->bodies->get(body).contacts->of(body);
}
ContactForce AttachedBodies::contact_force(const btCollisionObject& object) const {
  ContactForce sum;
  const Identity name{&object, serial_of(object)};
  const Vector3 center = center_of_mass(object);
  for (const HeldBody* held : attached_->bodies->all_listed()) held->contacts->add_force_on(name, center, sum);
  return sum;
}
void AttachedBodies::set_contact_callback(ContactCallback callback) {
  attached_->contact_callback = std::make_shared<const ContactCallback>(std::move(callback));
}
const EnergyFlows& AttachedBodies::flows(const btSoftBody& body) const {
  return attached_->bodies->get(body).stepped.flows;
}
std::vector<LedgerEntry> AttachedBodies::ledger(const btSoftBody& body) const {
  return penalty::ledger(field(body), particles(body).positions);
}
PackedVectors AttachedBodies::forces(const btSoftBody& body) const {
  PackedVectors forces = PackedVectors::Zero(4, particles(body).size());
  field(body).add_forces(particles(body).positions, forces);
  return forces;
}
PotentialField& AttachedBodies::edit(const btSoftBody& body) {
  HeldBody& held = attached_->bodies->get(body);
  held.body->activate(true);
  held.stepped.positions_changed();
  return held.field;
}
void AttachedBodies::take_joints_of(btDiscreteDynamicsWorld& world) { attached_->joints.take_from(world); }
int AttachedBodies::couple(const std::vector<CouplingPoint>& points, PotentialField field, Real damping_time) {
  return attached_->couplings.add(*attached_->bodies, points, std::move(field), damping_time);
}
void AttachedBodies::uncouple(int coupling) { attached_->couplings.remove(coupling); }
const PotentialField& AttachedBodies::coupling_field(int coupling) const {
  return attached_->couplings.get(coupling).field;
}
PotentialField& AttachedBodies::edit_coupling(int coupling) {
  HeldCoupling& held = attached_->couplings.get(coupling);
  attached_->couplings.wake(held);
  return held.field;
}
Real AttachedBodies::coupling_energy(int coupling) const {
  return attached_->couplings.get(coupling).stepped.elastic_energy;
}
void AttachedBodies::refresh(const btSoftBody& body) {
  HeldBody& held = attached_->bodies->get(body);
  held.stale = true;
  held.stepped.positions_changed();
}
void AttachedBodies::synchronize(const btSoftBody& body) { attached_->bodies->get(body).read_nodes(); }

}  // namespace penalty
