#include "contact_sweep.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace penalty {
namespace {

/// Side b of a contact at this instant, seen from the point of side a.
class Opposite {
 public:
  Opposite(Island& island, const Contact& contact, const Vector3& x)
      : side_(contact.b),
        rigid_(contact.b.is_rigid() ? &island.rigid_bodies[contact.b.rigid] : nullptr),
        soft_(rigid_ ? nullptr : island.bodies[contact.b.body]) {
    if (rigid_) {
      arm_ = x - rigid_->position;
      offset_ = arm_ - rigid_->rotation * side_.anchor;
      normal_ = rigid_->rotation * contact.normal;
      velocity_ = rigid_->velocity_at(arm_);
    } else {
      offset_ = x - side_.point.of(soft_->particles.positions);
      normal_ = contact.normal;
      velocity_ = side_.point.of(soft_->particles.velocities);
      mobility_ = side_.point.mobility(soft_->particles.inverse_masses);
    }
  }

  const Vector3& offset() const { return offset_; }  // from the point of b to that of a [m]
  const Vector3& normal() const { return normal_; }
  const Vector3& velocity() const { return velocity_; }  // where a is [m/s]

  /// It may move, and takes no impulse.
  bool is_obstacle() const { return rigid_ ? !rigid_->is_dynamic() : mobility_ <= 0; }

  Real mobility(const Vector3& direction) const {
    return rigid_ ? rigid_->mobility_at(arm_, direction) : mobility_ * direction.squaredNorm();
  }

  void push(const Vector3& impulse) const {
    if (rigid_)
      rigid_->push(impulse, arm_);
    else
      side_.point.add_push(impulse, soft_->particles.inverse_masses, soft_->particles.velocities);
  }

 private:
  const Side& side_;
  RigidBody* rigid_;
  SteppedBody* soft_;
  Real mobility_ = 0;
  Vector3 arm_, offset_, normal_, velocity_;
};

// What an impulse on the point gives to whoever drives the particles of it that are held [J].
Real driving_work(const WeightedPoint& point, const Vector3& impulse, const Particles& particles) {
  Real work = 0;
  for (int k = 0; k < point.size; ++k)
    if (const int i = point.particles[k]; particles.inverse_masses[i] == 0)
      work += point.weights[k] * impulse.dot(particles.velocities.col(i).head<3>());
  return work;
}

// The contacts of points that are held with what may move. Nothing gives way on their side: pushed off one by one, what
// lies on many of them would spin and hop. So their impulses are one solution of the same conditions, by projected
// Gauss-Seidel: each may be taken back as far as it was given. It begins with equal shares.
class HeldContacts {
 public:
  HeldContacts(Island& island, std::size_t body, Real duration, ContactWork& work)
      : island_(island),
        contacts_(contacts_of(island, body)),
        particles_(island.bodies[body]->particles),
        slop_(island.bodies[body]->options.contact_slop),
        duration_(duration),
        work_(work) {}

  void solve() {
    constexpr int most_passes = 30;
    constexpr Real tolerance = 1e-5;  // of the largest change of a speed at the beginning
    const Real first = share();
    work_.change = std::max(work_.change, first);
    for (int pass = 0; pass < most_passes; ++pass) {
      Real largest = 0;
      for (std::size_t k = 0; k < contacts_.size(); ++k) {
        Contact& contact = contacts_[pass % 2 == 0 ? k : contacts_.size() - 1 - k];
        if (is_between(contact)) largest = std::max(largest, give(contact, impulse_of(contact)));
      }
      if (largest <= tolerance * first) return;
    }
  }

 private:
  Opposite opposite_of(const Contact& contact) const {
    return {island_, contact, contact.a.point.of(particles_.positions)};
  }
  static Vector3 normal_of(const Contact& contact, const Opposite& opposite) {
    return contact.radius > 0 && !opposite.offset().isZero(0) ? Vector3(opposite.offset().normalized())
                                                              : opposite.normal();
  }
  Real wanted_speed(Real gap) const {
    return gap > 0 ? -gap / duration_
                   : std::clamp<Real>((-gap - slop_) / std::max(recovery_time, duration_), 0, recovery_speed);
  }

  bool is_between(const Contact& contact) const {
    return contact.a.point.mobility(particles_.inverse_masses) <= 0 && !opposite_of(contact).is_obstacle();
  }

  // Each as if it were the only one, divided by the number of those that come closer.
  Real share() {
    Real number = 0, largest = 0;
    for (Contact& contact : contacts_) {
      if (!is_between(contact)) continue;
      contact.impulse = impulse_of(contact);
      number += !contact.impulse.isZero(0);
    }
    for (Contact& contact : contacts_) {
      if (!is_between(contact) || contact.impulse.isZero(0)) continue;
      const Vector3 shared = contact.impulse / number;
      contact.impulse.setZero();
      largest = std::max(largest, give(contact, shared));
    }
    return largest * number;
  }

  // What it should have been given.
  Vector3 impulse_of(Contact& contact) const {
    const Opposite opposite = opposite_of(contact);
    const Vector3 normal = normal_of(contact, opposite);
    const Real gap = normal.dot(opposite.offset()) - contact.radius;
    contact.depth = std::max(contact.depth, -gap);
    const Vector3 relative = contact.a.point.of(particles_.velocities) - opposite.velocity();
    const Real speed = normal.dot(relative), given = normal.dot(contact.impulse);
    const Real pressed = std::max<Real>(given + (wanted_speed(gap) - speed) / opposite.mobility(normal), 0);
    Vector3 rubbed = contact.impulse - given * normal;
    const Vector3 slip = relative - speed * normal;
    if (const Real slip_speed = slip.norm(); contact.friction > 0 && slip_speed > 1e-12)
      rubbed -= slip / opposite.mobility(slip / slip_speed);
    const Real size = rubbed.norm(), most = contact.friction * pressed;
    if (size > most) rubbed *= most / size;
    return pressed * normal + rubbed;
  }

  // Returns the change of its speed [m/s].
  Real give(Contact& contact, const Vector3& impulse) {
    const Opposite opposite = opposite_of(contact);
    const Vector3 normal = normal_of(contact, opposite), change = impulse - contact.impulse;
    const Vector3 at_point = contact.a.point.of(particles_.velocities), relative = at_point - opposite.velocity();
    const Real gap = normal.dot(opposite.offset()) - contact.radius;
    const Real recovery = normal.dot(change) * std::max<Real>(wanted_speed(gap), 0);
    work_.outside += recovery - change.dot(at_point);
    work_.loss += recovery - change.dot(relative) - opposite.mobility(change) / 2;
    opposite.push(-change);
    contact.impulse = impulse;
    return std::abs(normal.dot(change)) * opposite.mobility(normal);
  }

  Island& island_;
  std::span<Contact> contacts_;
  const Particles& particles_;
  Real slop_, duration_;
  ContactWork& work_;
};

}  // namespace

void sort_contacts(Island& island) {
  std::vector<std::size_t>& begin = island.contacts_begin;
  begin.assign(island.bodies.size() + 1, 0);
  for (const Contact& contact : island.contacts) ++begin[contact.a.body + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  const auto before = [](const Contact& l, const Contact& r) { return l.a.body < r.a.body; };
  if (std::is_sorted(island.contacts.begin(), island.contacts.end(), before)) return;
  std::vector<std::size_t> next = begin;
  std::vector<Contact> sorted(island.contacts.size());
  for (const Contact& contact : island.contacts) sorted[next[contact.a.body]++] = contact;
  island.contacts = std::move(sorted);
}

bool is_in_contact(const Island& island, std::size_t body) {
  if (island.contacts_begin[body] != island.contacts_begin[body + 1]) return true;
  return std::any_of(island.contacts.begin(), island.contacts.end(),
                     [&](const Contact& contact) { return contact.b.body == static_cast<int>(body); });
}

ContactWork solve_contacts(Island& island, std::size_t body, Real duration) {
  ContactWork work;
  bool has_held = false;
  Particles& particles = island.bodies[body]->particles;
  const Real slop = island.bodies[body]->options.contact_slop;
  for (Contact& contact : contacts_of(island, body)) {
    const WeightedPoint& point = contact.a.point;
    contact.impulse.setZero();
    const Real point_mobility = point.mobility(particles.inverse_masses);
    if (point_mobility <= 0) {
      has_held = true;
      continue;
    }

    const Opposite opposite(island, contact, point.of(particles.positions));
    const Vector3& offset = opposite.offset();
    Vector3 normal = opposite.normal();
    if (contact.radius > 0 && !offset.isZero(0)) normal = offset.normalized();
    const Real gap = normal.dot(offset) - contact.radius;
    contact.depth = std::max(contact.depth, -gap);
    const Vector3& obstacle_velocity = opposite.velocity();
    const Vector3 relative = point.of(particles.velocities) - obstacle_velocity;
    const Real normal_speed = normal.dot(relative);

    Real wanted = -gap / duration;
    if (gap <= 0) wanted = std::clamp<Real>((-gap - slop) / std::max(recovery_time, duration), 0, recovery_speed);
    if (normal_speed >= wanted) continue;
    work.change = std::max(work.change, wanted - normal_speed);
    const Real normal_impulse = (wanted - normal_speed) / (point_mobility + opposite.mobility(normal));
    Vector3 impulse = normal_impulse * normal;
    const Vector3 slip = relative - normal_speed * normal;
    const Real slip_speed = slip.norm();
    if (contact.friction > 0 && slip_speed > 1e-12) {
      const Vector3 direction = slip / slip_speed;
      const Real stopping = slip_speed / (point_mobility + opposite.mobility(direction));
      impulse -= std::min(contact.friction * normal_impulse, stopping) * direction;
    }

    contact.impulse = impulse;
    const Real recovery = std::max<Real>(normal_impulse * wanted, 0);  // as of an obstacle that moves so fast
    work.outside += recovery;
    work.loss +=
        recovery - impulse.dot(relative) - (point_mobility * impulse.squaredNorm() + opposite.mobility(impulse)) / 2;
    work.outside -= driving_work(point, impulse, particles);
    point.add_push(impulse, particles.inverse_masses, particles.velocities);
    if (opposite.is_obstacle())
      work.outside += impulse.dot(obstacle_velocity);
    else
      opposite.push(-impulse);
  }
  if (has_held) HeldContacts(island, body, duration, work).solve();
  return work;
}

}  // namespace penalty
