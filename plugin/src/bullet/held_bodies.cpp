#include "held_bodies.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "face_tree.h"

namespace penalty {
namespace {

// A quarter of the diagonal: what is held further away than its own size is no body any more, but a cloud of points.
Real largest_margin_of(const Positions& rest) {
  constexpr Real share = 0.25;
  const auto points = rest.topRows<3>();
  const Real size = points.cols() == 0 ? 0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  return size > 0 ? share * size : std::numeric_limits<Real>::infinity();
}

}  // namespace

HeldBody::HeldBody(btSoftBody& soft_body, PotentialField potential_field, const AttachOptions& attach_options)
    : body(&soft_body),
      serial(give_serial(soft_body)),
      field(std::move(potential_field)),
      options(attach_options),
      largest_margin(largest_margin_of(field.rest_positions())),
      nodes(soft_body, stepped.particles) {
  stepped.field = &field;
  stepped.options = options.step;
  start = stepped.particles.positions;
}

Real HeldBody::margin() const { return std::min<Real>(body->getCollisionShape()->getMargin(), largest_margin); }

void HeldBody::read_nodes(Real duration) {
  const NodeChanges changes = nodes.read(stepped.particles, duration);
  if (changes.moved) {
    start = stepped.particles.positions;
    stepped.positions_changed();
  }
  stale = stale || changes.lighter;  // heavier particles only leave the estimate too high
}

void HeldBody::let_torn_faces_go() {
  if (!torn_faces.update(*body, field)) return;
  keep_face_tree(*body);
  surface.reset();
  mesh_sides.forget();
}

void HeldBody::give_faces_back() {
  if (!torn_faces.give_back(*body)) return;
  body->m_fdbvt.clear();  // its leaves have the boxes of the faces that were torn
  keep_face_tree(*body);
}

void HeldBody::measure() {
  const Particles& particles = stepped.particles;
  box = {};
  fastest2 = 0;
  for (int i = 0; i < particles.size(); ++i) {
    box.add(particles.positions.col(i).head<3>());
    fastest2 = std::max(fastest2, particles.velocities.col(i).head<3>().squaredNorm());
  }
}

void HeldBody::hold(const char* problem, bool stopped) noexcept {
  outcome = StepOutcome::held;
  StepReport& report = stepped.report;
  const Real elastic_energy = report.elastic_energy;
  report = {};
  report.elastic_energy = elastic_energy;
  try {
    report.problem = problem;
  } catch (const std::bad_alloc&) {
    report.problem = "out of memory";  // short enough to need none
  }
  nodes.arrive(stepped.particles, start);
  stepped.particles.positions = start;
  if (stopped) {
    stepped.particles.velocities.setZero();
    nodes.stop();
  } else {
    report.kinetic_energy = kinetic_energy(stepped.particles);
  }
  stepped.positions_changed();
  contacts->clear();
  body->setDeactivationTime(0);  // stays awake, to recover
}

HeldBody* HeldBodies::find(const btSoftBody& body) const {
  const auto found = bodies_.find(&body);
  return found != bodies_.end() && found->second->serial == serial_of(body) ? found->second.get() : nullptr;
}

HeldBody& HeldBodies::get(const btSoftBody& body) const {
  if (HeldBody* held = find(body)) return *held;
  throw std::invalid_argument("soft body is not attached");
}

HeldBody* HeldBodies::find(const Identity& name) const {
  const auto found = bodies_.find(name.address);
  return found != bodies_.end() && found->second->serial == name.serial ? found->second.get() : nullptr;
}

HeldBody& HeldBodies::add(btSoftBody& body, PotentialField field, const AttachOptions& options) {
  auto held = std::make_unique<HeldBody>(body, std::move(field), options);
  held->order = ++attached_;
  return *(bodies_[&body] = std::move(held));  // in the place of one that is gone
}

void HeldBodies::list(std::span<btSoftBody* const> bodies) {
  ++step_;
  for (btSoftBody* body : bodies) {
    const auto found = bodies_.find(body);
    if (found == bodies_.end()) continue;
    if (found->second->serial != serial_of(*body)) {
      bodies_.erase(found);
      continue;
    }
    HeldBody& held = *found->second;
    held.listed = step_;
    held.outcome = StepOutcome::none;
    held.start = held.stepped.particles.positions;
  }
}

std::vector<const HeldBody*> HeldBodies::all_listed() const {
  std::vector<const HeldBody*> found;
  for (const auto& [address, held] : bodies_)
    if (is_listed(*held)) found.push_back(held.get());
  std::ranges::sort(found, {}, &HeldBody::order);
  return found;
}

bool HeldBodies::is_there(const Identity& name) const {
  const HeldBody* held = find(name);
  return held && (held->listed == 0 || is_listed(*held));
}

}  // namespace penalty
