// Particles that are held at points of rigid bodies.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// Two-sided constraints on velocities: the relative velocity of a particle and of the point of the rigid body that is
/// where the particle is comes to zero, but for what takes back the way between the particle and its anchor: a fifth of it
/// in each drift, at half a metre a second at most, as work from outside. Of an anchor of less than full influence that
/// share of the change is made in each drift. Both take the impulse at the particle, so both momenta are kept.
class Anchors {
 public:
  explicit Anchors(Island& island) : island_(island) {}

  bool is_empty() const { return island_.anchors.empty(); }

  /// Before the sweeps of a drift of h [s]; `since` [s] is how long forces acted since the last: as in the last one, they
  /// are met by its impulses.
  void begin(Real h, Real since);

  /// Returns the largest change of a relative velocity [m/s].
  Real sweep();

  /// Keeps what the sweeps came to.
  void end(Real since);

  /// Begins an attempt at the step.
  void begin_attempt();

  /// Of bodies that move and take no impulse, of driven particles, and of ways that are taken back, in this attempt [J].
  Real outside_work() const { return outside_work_; }

 private:
  struct Row {
    SteppedBody* body = nullptr;
    const WeightedPoint* point = nullptr;
    RigidBody* rigid = nullptr;
    Vector3 arm = Vector3::Zero(), wanted = Vector3::Zero(), start = Vector3::Zero();  // relative velocities
    Matrix3 inertia = Matrix3::Zero();  // of the impulse that changes one
    Vector3 impulse = Vector3::Zero();

    Vector3 relative_velocity() const { return point->of(body->particles.velocities) - rigid->velocity_at(arm); }
    void push(const Vector3& given);
  };

  Island& island_;
  std::vector<Row> rows_;
  std::vector<Vector3> forces_;  // of each anchor in the last drift [N]
  Real outside_work_ = 0;
};

}  // namespace penalty
