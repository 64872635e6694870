#include "contact_sweep.h"

#include <algorithm>

namespace penalty {
namespace {

constexpr Real recovery_time = 0.05;  // in which depth is taken back [s],
constexpr Real recovery_speed = 0.5;  // no faster than this [m/s]

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

}  // namespace

void sort_contacts(Island& island) {
  const auto before = [](const Contact& l, const Contact& r) { return l.a.body < r.a.body; };
  if (!std::is_sorted(island.contacts.begin(), island.contacts.end(), before))
    std::stable_sort(island.contacts.begin(), island.contacts.end(), before);
  island.contacts_begin.assign(island.bodies.size() + 1, island.contacts.size());
  for (std::size_t k = island.contacts.size(); k-- > 0;)
    for (int body = island.contacts[k].a.body; body >= 0 && island.contacts_begin[body] != k; --body)
      island.contacts_begin[body] = k;
}

bool is_in_contact(const Island& island, std::size_t body) {
  if (island.contacts_begin[body] != island.contacts_begin[body + 1]) return true;
  return std::any_of(island.contacts.begin(), island.contacts.end(),
                     [&](const Contact& contact) { return contact.b.body == static_cast<int>(body); });
}

ContactWork solve_contacts(Island& island, std::size_t body, Real duration) {
  ContactWork work;
  Particles& particles = island.bodies[body]->particles;
  const Real slop = island.bodies[body]->options.contact_slop;
  for (Contact& contact : contacts_of(island, body)) {
    const WeightedPoint& point = contact.a.point;
    contact.impulse.setZero();
    const Real point_mobility = point.mobility(particles.inverse_masses);
    if (point_mobility <= 0) continue;

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
    point.add_push(impulse, particles.inverse_masses, particles.velocities);
    if (opposite.is_obstacle())
      work.outside += impulse.dot(obstacle_velocity);
    else
      opposite.push(-impulse);
  }
  return work;
}

}  // namespace penalty
