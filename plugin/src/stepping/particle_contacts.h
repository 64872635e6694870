// Contacts of particles, and of points between them, with rigid bodies and with each other.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// What an impulse on the point gives to whoever drives the particles of it that are held [J].
Real driving_work(const WeightedPoint& point, const Vector3& impulse, const Particles& particles);

/// Where a contact is.
struct ContactPlace {
  Vector3 at, offset, normal;  // the point of a, the way to it from that of b, and that from b to a
  Real gap;                    // negative: depth [m]
};
ContactPlace place_of(const Contact& contact, const Island& island);

/// Adds contacts of particles, as they are now, to the reports of the bodies.
void report_particle_contacts(Island& island);

/// A contact in one drift.
struct ParticleContactRow {
  Contact* contact = nullptr;
  SteppedBody *body = nullptr, *other = nullptr;  // of the point of a; of that of b, if it is one of particles
  RigidBody* rigid = nullptr;
  Vector3 arm = Vector3::Zero(), normal = Vector3::Zero();  // from the centre of the rigid body; from b to a
  Real point_mobility = 0;                                  // of the point of a [1/kg],
  Matrix3 other_mobility = Matrix3::Zero();                 // of the other one,
  Real normal_mobility = 0;                                 // and of both, along the normal
  Real wanted = 0, recovery = 0;
  bool is_driven = false;    // some particle of a is held
  bool is_obstacle = false;  // b takes no impulse
  Vector3 impulse = Vector3::Zero(), start = Vector3::Zero();

  bool is_held() const { return point_mobility <= 0; }
  Vector3 velocity_of_other() const;

  /// Of both, along an impulse; times its square.
  Real mobility(const Vector3& given) const {
    return point_mobility * given.squaredNorm() + (is_obstacle ? 0 : given.dot(other_mobility * given));
  }
};

/// One-sided constraints on velocities, met by sequential impulses that are summed and clipped contact by contact, as
/// those of RigidContacts: a sweep may take back what an earlier one gave too much. Of the gap g and the relative normal
/// speed u a contact asks u >= -g/h while the gap is open and u >= 0 when it is closed: it stops approach. Depth beyond
/// the slop of the body is taken back: there it asks u >= depth / 0.05 s, at most half a metre a second, which two bodies
/// that can move reach at 100 m/s² at most, and what that gives is work from outside. So is what driven particles give to
/// a body that they push; two that cannot move are left alone. The impulse goes to side a and, with the opposite sign, to
/// side b: to a rigid body at the point of a, so that both momenta are kept to round-off. Friction is clipped to Coulomb's
/// cone.
class ParticleContacts {
 public:
  explicit ParticleContacts(Island& island);

  bool is_empty() const { return island_.contacts.empty(); }

  /// What one of them gives may change what another one needs: one sweep is not enough.
  bool are_coupled() const;

  /// Before the sweeps of a drift of h [s]; `since` [s] is how long forces acted since the last: as in the last one, they
  /// are met by its impulses, unless one sweep is enough.
  void begin(Real h, Real since);

  /// Returns the largest change of a normal speed [m/s].
  Real sweep();

  /// Keeps what the sweeps came to. Depth that comes back faster than was asked, as sweeps have an end, is work from
  /// outside, too.
  void end(Real since);

  /// Begins an attempt at the step.
  void begin_attempt();

  /// Of bodies that move and take no impulse, of driven particles, and of taking depth back, in this attempt [J].
  Real outside_work() const { return outside_work_; }

 private:
  using Row = ParticleContactRow;

  static Vector3 relative_velocity(const Row& row) {
    return row.contact->a.point.of(row.body->particles.velocities) - row.velocity_of_other();
  }
  void start(Real since);
  static Vector3 into_cone(const Row& row, const Vector3& impulse);
  Vector3 impulse_of(const Row& row, const Vector3& relative) const;
  Real give(Row& row, const Vector3& impulse);
  Real update(Row& row);
  void share_among_held();
  Real settle_held();

  Island& island_;
  std::vector<Row>& rows_;  // of the island, which keeps their memory
  bool has_held_ = false, starts_warm_ = false;
  Real outside_work_ = 0;
};

}  // namespace penalty
