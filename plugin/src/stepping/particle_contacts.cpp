#include "particle_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contact_rules.h"

namespace penalty {
namespace {

constexpr int most_held_passes = 30;   // in a sweep; they end when one changes no speed by more than
constexpr Real held_tolerance = 1e-5;  // this share of what the first did

bool has_held_particle(const WeightedPoint& point, const Particles& particles) {
  for (int k = 0; k < point.size; ++k)
    if (particles.inverse_masses[point.particles[k]] == 0) return true;
  return false;
}

Real slop_of(const SteppedBody& body) {
  return body.options.contact_slop * (body.size > 0 ? std::min<Real>(body.size, 1) : 1);
}

}  // namespace

Real driving_work(const WeightedPoint& point, const Vector3& impulse, const Particles& particles) {
  Real work = 0;
  for (int k = 0; k < point.size; ++k)
    if (const int i = point.particles[k]; particles.inverse_masses[i] == 0)
      work += point.weights[k] * impulse.dot(particles.velocities.col(i).head<3>());
  return work;
}

ContactPlace place_of(const Contact& contact, const Island& island) {
  ContactPlace place{.at = contact.a.point.of(island.bodies[contact.a.body]->particles.positions),
                     .offset = {},
                     .normal = contact.normal,
                     .gap = 0};
  if (contact.b.is_rigid()) {
    const RigidBody& rigid = island.rigid_bodies[contact.b.rigid];
    place.offset = place.at - rigid.position - rigid.rotation * contact.b.anchor;
    place.normal = rigid.rotation * contact.normal;
  } else {
    place.offset = place.at - contact.b.point.of(island.bodies[contact.b.body]->particles.positions);
  }
  if (contact.radius > 0 && !place.offset.isZero(0)) place.normal = place.offset.normalized();
  place.gap = place.normal.dot(place.offset) - contact.radius;
  return place;
}

Vector3 ParticleContactRow::velocity_of_other() const {
  return rigid ? rigid->velocity_at(arm) : contact->b.point.of(other->particles.velocities);
}

ParticleContacts::ParticleContacts(Island& island)
    : island_(island),
      rows_(island.particle_contact_rows ? *island.particle_contact_rows
                                         : *(island.particle_contact_rows = std::make_shared<std::vector<Row>>())),
      starts_warm_(are_coupled() || !island.surfaces.empty()) {}

bool ParticleContacts::are_coupled() const {
  return std::any_of(island_.contacts.begin(), island_.contacts.end(), [&](const Contact& contact) {
    return !contact.b.is_rigid() || island_.rigid_bodies[contact.b.rigid].is_dynamic();
  });
}

void ParticleContacts::begin(Real h, Real since) {
  rows_.clear();
  rows_.reserve(island_.contacts.size());
  has_held_ = false;
  for (Contact& contact : island_.contacts) {
    if (since > 0) contact.given.is_last = false;
    Row row;
    row.contact = &contact;
    row.body = island_.bodies[contact.a.body];
    const Particles& particles = row.body->particles;
    const WeightedPoint& point = contact.a.point;
    const auto [at, offset, normal, gap] = place_of(contact, island_);
    row.normal = normal;
    if (contact.b.is_rigid()) {
      row.rigid = &island_.rigid_bodies[contact.b.rigid];
      row.arm = at - row.rigid->position;
      row.is_obstacle = !row.rigid->is_dynamic();
      if (!row.is_obstacle) row.other_mobility = row.rigid->mobility_at(row.arm);
    } else {
      row.other = island_.bodies[contact.b.body];
      const Real mobility = contact.b.point.mobility(row.other->particles.inverse_masses);
      row.is_obstacle = mobility <= 0;
      row.other_mobility.diagonal().setConstant(mobility);
    }
    row.point_mobility = point.mobility(particles.inverse_masses);
    if (row.is_held() && row.is_obstacle) continue;
    has_held_ = has_held_ || row.is_held();
    row.is_driven = has_held_particle(point, particles);
    if (-gap <= contact.deepest) row.recovery = recovery_of(-gap, slop_of(*row.body), h);
    if (row.recovery > 0 && !row.is_obstacle && !row.is_held())
      row.recovery =
          std::min(row.recovery, std::max<Real>(row.normal.dot(relative_velocity(row)), 0) + recovery_acceleration * h);
    row.wanted = gap > 0 ? -gap / h : row.recovery;
    row.normal_mobility = row.mobility(row.normal);
    rows_.push_back(row);
  }
  if (starts_warm_) start(since);
  if (has_held_) share_among_held();
}

// With what they gave before: the share of it that is best for all.
void ParticleContacts::start(Real since) {
  Real before = 0, after = 0;
  for (Row& row : rows_) {
    row.start.setZero();
    if (row.is_held() || row.contact->memory.is_empty()) continue;
    row.start = into_cone(row, row.contact->memory.start(since));
    before += row.start.dot(relative_velocity(row) - row.wanted * row.normal);
  }
  if (!(before < 0)) return;
  for (Row& row : rows_)
    if (!row.start.isZero(0)) give(row, row.start);
  for (const Row& row : rows_) after += row.start.dot(relative_velocity(row) - row.wanted * row.normal);
  const Real share = best_share(before, after);
  if (share == 1) return;
  for (Row& row : rows_)
    if (!row.start.isZero(0)) give(row, share * row.start);
}

void ParticleContacts::begin_attempt() {
  outside_work_ = 0;
  for (Contact& contact : island_.contacts) {
    contact.memory = {};
    contact.given = {};
  }
}

// The nearest that presses, and rubs no more than it may.
Vector3 ParticleContacts::into_cone(const Row& row, const Vector3& impulse) {
  const Real pressed = row.normal.dot(impulse);
  if (!(pressed > 0)) return Vector3::Zero();
  const Vector3 rubbed = impulse - pressed * row.normal;
  return pressed * row.normal + no_longer_than(row.contact->friction * pressed, rubbed);
}

// What it should have been given.
Vector3 ParticleContacts::impulse_of(const Row& row, const Vector3& relative) const {
  const Real speed = row.normal.dot(relative), given = row.normal.dot(row.impulse);
  const Real pressed = given + (row.wanted - speed) / row.normal_mobility;
  if (!(pressed > 0)) return Vector3::Zero();
  Vector3 rubbed = row.impulse - given * row.normal;
  const Vector3 slip = relative - speed * row.normal;
  if (const Real slip_speed = slip.norm(); row.contact->friction > 0 && slip_speed > 1e-12)
    rubbed -= slip / row.mobility(slip / slip_speed);
  return into_cone(row, pressed * row.normal + rubbed);
}

// Returns the change of its normal speed [m/s].
Real ParticleContacts::give(Row& row, const Vector3& impulse) {
  const Vector3 change = impulse - row.impulse;
  Particles& particles = row.body->particles;
  const WeightedPoint& point = row.contact->a.point;
  const Vector3 of_other = row.velocity_of_other();
  const Vector3 relative = point.of(particles.velocities) - of_other;
  const Real along = row.normal.dot(change);
  const Real recovery = along * row.recovery;  // as of an obstacle that moves so fast
  row.body->step_flows.contact_loss += recovery - change.dot(relative) - row.mobility(change) / 2;
  outside_work_ += recovery;
  if (row.is_driven) outside_work_ -= driving_work(point, change, particles);
  if (!row.is_held()) point.add_push(change, particles.inverse_masses, particles.velocities);
  if (row.is_obstacle)
    outside_work_ += change.dot(of_other);
  else if (row.rigid)
    row.rigid->push(-change, row.arm);
  else
    row.contact->b.point.add_push(-change, row.other->particles.inverse_masses, row.other->particles.velocities);
  row.impulse = impulse;
  return std::abs(along) * row.normal_mobility;
}

Real ParticleContacts::update(Row& row) {
  const Vector3 impulse = impulse_of(row, relative_velocity(row));
  return impulse == row.impulse ? 0 : give(row, impulse);
}

Real ParticleContacts::sweep() {
  Real largest = 0;
  for (Row& row : rows_)
    if (!row.is_held()) largest = std::max(largest, update(row));
  return has_held_ ? std::max(largest, settle_held()) : largest;
}

// Nothing gives way at points that are held: pushed off one by one, what lies on many of them would spin and hop. They
// begin with what each would give alone, divided by their number.
void ParticleContacts::share_among_held() {
  Real number = 0;
  for (Row& row : rows_) {
    if (!row.is_held()) continue;
    row.impulse = impulse_of(row, relative_velocity(row));
    number += !row.impulse.isZero(0);
  }
  for (Row& row : rows_)
    if (row.is_held() && !row.impulse.isZero(0)) give(row, std::exchange(row.impulse, Vector3::Zero()) / number);
}

// Forth and back until nothing changes.
Real ParticleContacts::settle_held() {
  Real first = 0;
  for (int pass = 0; pass < most_held_passes; ++pass) {
    Real largest = 0;
    for (std::size_t k = 0; k < rows_.size(); ++k)
      if (Row& row = rows_[pass % 2 == 0 ? k : rows_.size() - 1 - k]; row.is_held())
        largest = std::max(largest, update(row));
    if (pass == 0) first = largest;
    if (largest <= held_tolerance * first) break;
  }
  return first;
}

void ParticleContacts::end(Real since) {
  for (const Row& row : rows_) {
    if (starts_warm_) row.contact->memory.keep(row.impulse, row.normal, since);
    if (row.impulse.isZero(0)) continue;
    const Real along = row.normal.dot(row.impulse);
    const Vector3 across = row.impulse - along * row.normal;
    row.contact->given.add(row.normal, along, across, is_at_limit(across.norm(), row.contact->friction * along));
    if (row.wanted < 0) continue;  // what was open
    const Real excess = row.normal.dot(relative_velocity(row)) - row.wanted;
    if (excess > 0) outside_work_ += excess * along;
  }
}

}  // namespace penalty
