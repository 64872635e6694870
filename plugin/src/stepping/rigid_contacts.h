// Contacts between rigid bodies, which the soft ones press on each other.
#pragma once
#include <array>

#include "penalty/stepping/island.h"

namespace penalty {

/// Where a contact is: halfway between the points of a and b, with the normal from b to a.
struct RigidContactPlace {
  Vector3 at, normal;
  Real gap;  // negative: depth [m]
};
RigidContactPlace place_of(const RigidContact& contact, const Island& island);

/// Sequential impulses on the velocities of a substep, summed and clipped contact by contact: E. Catto, Iterative Dynamics
/// with Temporal Coherence (2005). Of the gap g and the relative normal speed u each asks u >= -g/h while the gap is open,
/// u >= 0 when it is closed; depth comes back as in ParticleContacts. Both bodies take the impulse at the same point, so both
/// momenta are kept. Friction is clipped to Coulomb's cone, and moments against rolling and spinning to their shares of the
/// force along the normal.
class RigidContacts {
 public:
  explicit RigidContacts(Island& island);

  Real acceleration() const { return acceleration_; }
  bool is_empty() const { return island_.rigid_contacts.empty(); }

  /// Before the sweeps of a drift of h [s]; `since` [s] is how long forces acted since the last: as in the last one, they
  /// are met by its impulses.
  void begin(Real h, Real since);

  /// Returns the largest change of a normal speed [m/s].
  Real sweep();

  /// Keeps what the sweeps came to.
  void end(Real since);

  /// Begins an attempt at the step with the forces that the contacts had before it.
  void begin_attempt();

  /// Of bodies that move and take no impulse, and of taking depth back, in this attempt [J].
  Real outside_work() const { return outside_work_; }

 private:
  struct Row {
    RigidBody *a = nullptr, *b = nullptr;
    bool a_moves = false, b_moves = false;
    Vector3 arm_a, arm_b, normal;
    Matrix3 mobility = Matrix3::Zero();  // of both
    Real normal_mobility = 0, wanted = 0, recovery = 0;
    bool is_impact = false;
    Real impulse = 0;
    Vector3 friction_impulse = Vector3::Zero();
    Real lever = 0;                    // of turning, so that its speeds compare [m]
    Vector3 moment = Vector3::Zero();  // against it [N m s]
  };

  static Vector3 relative_velocity(const Row& row) {
    return row.a->velocity_at(row.arm_a) - row.b->velocity_at(row.arm_b);
  }
  static Vector3 relative_turning(const Row& row) { return row.a->angular_velocity - row.b->angular_velocity; }
  void push(const Row& row, const Vector3& impulse, const Vector3& moment = Vector3::Zero());
  Real rub(const RigidContact& contact, Row& row);
  Real brake_turning(const RigidContact& contact, Row& row);

  Island& island_;
  Real acceleration_ = 0;  // largest of a body [m/s²]
  std::vector<Row> rows_;
  std::vector<std::array<Vector3, 2>> start_;  // forces and moments before the step
  Real outside_work_ = 0;
};

}  // namespace penalty
