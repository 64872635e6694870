#include "rigid_contacts.h"

#include <algorithm>

#include "contact_rules.h"
#include "restitution.h"

namespace penalty {
namespace {

constexpr Real rigid_slop = 1e-4;  // depth that may stay [m]
// Approach, relative to what accelerations make of rest, whose impulse does not come again.
constexpr Real impact_approach = 4;

}  // namespace

RigidContactPlace place_of(const RigidContact& contact, const Island& island) {
  const RigidBody &a = island.rigid_bodies[contact.a], &b = island.rigid_bodies[contact.b];
  const Vector3 normal = b.rotation * contact.normal;
  Vector3 at_a = a.position + a.rotation * contact.anchor_a, at_b = b.position + b.rotation * contact.anchor_b;
  if (contact.radius > 0) {  // opposite that is what it has rolled to
    at_a -= contact.radius * normal;
    at_b += at_a - at_b - normal.dot(at_a - at_b) * normal;
  }
  return {.at = (at_a + at_b) / 2, .normal = normal, .gap = normal.dot(at_a - at_b)};
}

RigidContacts::RigidContacts(Island& island) : island_(island) {
  start_.reserve(island.rigid_contacts.size());
  for (const RigidContact& contact : island.rigid_contacts) start_.push_back({contact.force, contact.moment});
  for (const RigidBody& body : island.rigid_bodies) acceleration_ = std::max(acceleration_, body.acceleration.norm());
}

void RigidContacts::begin(Real h, Real since) {
  rows_.clear();
  for (const RigidContact& contact : island_.rigid_contacts) {
    RigidBody &a = island_.rigid_bodies[contact.a], &b = island_.rigid_bodies[contact.b];
    const auto [at, normal, gap] = place_of(contact, island_);
    Row row{.a = &a,
            .b = &b,
            .a_moves = a.is_dynamic(),
            .b_moves = b.is_dynamic(),
            .arm_a = at - a.position,
            .arm_b = at - b.position,
            .normal = normal};
    row.mobility = a.mobility_at(row.arm_a) + b.mobility_at(row.arm_b);
    row.normal_mobility = row.normal.dot(row.mobility * row.normal);
    const Real speed = row.normal.dot(relative_velocity(row));
    row.recovery = recovery_of(-gap, rigid_slop, h);
    row.wanted = gap > 0 ? -gap / h : row.recovery;
    row.is_impact = -speed > impact_approach * acceleration_ * since;
    if (-speed > restitution_threshold && -speed * h > gap)
      row.wanted = std::max(row.wanted, -contact.restitution * speed);
    if (contact.rolling > 0 || contact.spinning > 0)
      row.lever = std::max(row.a_moves ? row.arm_a.norm() : 0, row.b_moves ? row.arm_b.norm() : 0);
    rows_.push_back(row);
  }
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Row& row = rows_[k];
    if (!(row.normal_mobility > 0)) continue;
    const Vector3 expected = since * island_.rigid_contacts[k].force;
    row.impulse = std::max<Real>(row.normal.dot(expected), 0);
    row.friction_impulse = expected - row.normal.dot(expected) * row.normal;
    row.moment = since * island_.rigid_contacts[k].moment;
    push(row, row.impulse * row.normal + row.friction_impulse, row.moment);
    outside_work_ += row.impulse * row.recovery;
  }
}

void RigidContacts::push(const Row& row, const Vector3& impulse, const Vector3& moment) {
  const auto give = [this](RigidBody& body, bool moves, const Vector3& given, const Vector3& turning) {
    if (moves)
      body.give(given, turning);
    else
      outside_work_ -= given.dot(body.velocity) + turning.dot(body.angular_velocity);
  };
  give(*row.a, row.a_moves, impulse, row.arm_a.cross(impulse) + moment);
  give(*row.b, row.b_moves, -impulse, -(row.arm_b.cross(impulse) + moment));
}

Real RigidContacts::sweep() {
  Real largest = 0;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Row& row = rows_[k];
    if (!(row.normal_mobility > 0)) continue;
    const Vector3 relative = relative_velocity(row);
    const Real before = row.impulse;
    row.impulse = std::max<Real>(before + (row.wanted - row.normal.dot(relative)) / row.normal_mobility, 0);
    if (row.impulse == 0 && before == 0) continue;
    const Real change = row.impulse - before;
    if (change != 0) {
      largest = std::max(largest, std::abs(change) * row.normal_mobility);
      push(row, change * row.normal);
      outside_work_ += change * row.recovery;
    }

    largest = std::max(largest, rub(island_.rigid_contacts[k], row));
    if (row.lever > 0) largest = std::max(largest, brake_turning(island_.rigid_contacts[k], row));
  }
  return largest;
}

Real RigidContacts::rub(const RigidContact& contact, Row& row) {
  const Vector3 now = relative_velocity(row), slip = now - row.normal.dot(now) * row.normal;
  const Real speed = slip.norm();
  if (!(speed > 0) && row.friction_impulse.isZero(0)) return 0;
  const Vector3 direction = speed > 0 ? Vector3(slip / speed) : Vector3(row.friction_impulse.normalized());
  const Real mobility = direction.dot(row.mobility * direction);
  const Vector3 friction =
      no_longer_than(contact.friction * row.impulse, row.friction_impulse - speed / mobility * direction);
  const Vector3 change = friction - row.friction_impulse;
  push(row, change);
  row.friction_impulse = friction;
  return change.norm() * mobility;
}

// About the normal, and across it.
Real RigidContacts::brake_turning(const RigidContact& contact, Row& row) {
  Real largest = 0;
  for (const bool about : {true, false}) {
    const auto part = [&](const Vector3& v) -> Vector3 {
      const Vector3 along = row.normal.dot(v) * row.normal;
      return about ? along : Vector3(v - along);
    };
    const Vector3 turning = part(relative_turning(row)), given = part(row.moment);
    const Real speed = turning.norm(), most = (about ? contact.spinning : contact.rolling) * row.impulse;
    if (!(speed > 0) && given.isZero(0)) continue;
    const Vector3 direction = speed > 0 ? Vector3(turning / speed) : Vector3(given.normalized());
    Real mobility = 0;
    for (const RigidBody* body : {row.a, row.b})
      mobility += direction.dot(body->response(Vector3::Zero(), direction).second);
    if (!(mobility > 0)) continue;
    const Vector3 change = no_longer_than(most, given - speed / mobility * direction) - given;
    push(row, Vector3::Zero(), change);
    row.moment += change;
    largest = std::max(largest, change.norm() * mobility * row.lever);
  }
  return largest;
}

void RigidContacts::end(Real since) {
  if (!(since > 0)) return;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    RigidContact& contact = island_.rigid_contacts[k];
    contact.force = contact.moment = Vector3::Zero();
    if (row.is_impact) continue;
    contact.force = (row.impulse * row.normal + row.friction_impulse) / since;
    contact.moment = row.moment / since;
  }
}

void RigidContacts::begin_attempt() {
  outside_work_ = 0;
  for (std::size_t k = 0; k < start_.size(); ++k) {
    island_.rigid_contacts[k].force = start_[k][0];
    island_.rigid_contacts[k].moment = start_[k][1];
  }
}

}  // namespace penalty
