#include "rigid_contacts.h"

#include <algorithm>

#include "particle_contacts.h"
#include "restitution.h"

namespace penalty {
namespace {

constexpr Real rigid_slop = 1e-4;  // depth that may stay [m]
// Approach, relative to what accelerations make of rest, whose impulse does not come again.
constexpr Real impact_approach = 4;

}  // namespace

RigidContacts::RigidContacts(Island& island) : island_(island) {
  start_.reserve(island.rigid_contacts.size());
  for (const RigidContact& contact : island.rigid_contacts) start_.push_back(contact.force);
  for (const RigidBody& body : island.rigid_bodies) acceleration_ = std::max(acceleration_, body.acceleration.norm());
}

void RigidContacts::begin(Real h, Real since) {
  rows_.clear();
  for (const RigidContact& contact : island_.rigid_contacts) {
    RigidBody &a = island_.rigid_bodies[contact.a], &b = island_.rigid_bodies[contact.b];
    const Vector3 at_a = a.position + a.rotation * contact.anchor_a, at_b = b.position + b.rotation * contact.anchor_b;
    const Vector3 at = (at_a + at_b) / 2;
    Row row{.a = &a,
            .b = &b,
            .a_moves = a.is_dynamic(),
            .b_moves = b.is_dynamic(),
            .arm_a = at - a.position,
            .arm_b = at - b.position,
            .normal = b.rotation * contact.normal};
    row.mobility = a.mobility_at(row.arm_a) + b.mobility_at(row.arm_b);
    row.normal_mobility = row.normal.dot(row.mobility * row.normal);
    const Real gap = row.normal.dot(at_a - at_b), speed = row.normal.dot(relative_velocity(row));
    row.recovery = std::clamp<Real>((-gap - rigid_slop) / std::max(recovery_time, h), 0, recovery_speed);
    row.wanted = gap > 0 ? -gap / h : row.recovery;
    row.is_impact = -speed > impact_approach * acceleration_ * since;
    if (-speed > restitution_threshold && -speed * h > gap)
      row.wanted = std::max(row.wanted, -contact.restitution * speed);
    rows_.push_back(row);
  }
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Row& row = rows_[k];
    if (!(row.normal_mobility > 0)) continue;
    const Vector3 expected = since * island_.rigid_contacts[k].force;
    row.impulse = std::max<Real>(row.normal.dot(expected), 0);
    row.friction_impulse = expected - row.normal.dot(expected) * row.normal;
    push(row, row.impulse * row.normal + row.friction_impulse);
    outside_work_ += row.impulse * row.recovery;
  }
}

void RigidContacts::push(const Row& row, const Vector3& impulse) {
  const auto give = [this](RigidBody& body, bool moves, const Vector3& given, const Vector3& arm) {
    if (moves)
      body.push(given, arm);
    else
      outside_work_ -= given.dot(body.velocity_at(arm));
  };
  give(*row.a, row.a_moves, impulse, row.arm_a);
  give(*row.b, row.b_moves, -impulse, row.arm_b);
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

    const Real most = island_.rigid_contacts[k].friction * row.impulse;
    const Vector3 now = relative_velocity(row), slip = now - row.normal.dot(now) * row.normal;
    const Real speed = slip.norm();
    if (!(speed > 0) && row.friction_impulse.isZero(0)) continue;
    const Vector3 direction = speed > 0 ? Vector3(slip / speed) : Vector3(row.friction_impulse.normalized());
    const Real mobility = direction.dot(row.mobility * direction);
    Vector3 friction = row.friction_impulse - speed / mobility * direction;
    if (const Real size = friction.norm(); size > most) friction *= most / size;
    largest = std::max(largest, (friction - row.friction_impulse).norm() * mobility);
    push(row, friction - row.friction_impulse);
    row.friction_impulse = friction;
  }
  return largest;
}

void RigidContacts::end(Real since) {
  if (!(since > 0)) return;
  for (std::size_t k = 0; k < rows_.size(); ++k)
    island_.rigid_contacts[k].force =
        !rows_[k].is_impact ? Vector3((rows_[k].impulse * rows_[k].normal + rows_[k].friction_impulse) / since)
                            : Vector3::Zero();
}

void RigidContacts::begin_attempt() {
  outside_work_ = 0;
  for (std::size_t k = 0; k < start_.size(); ++k) island_.rigid_contacts[k].force = start_[k];
}

}  // namespace penalty
