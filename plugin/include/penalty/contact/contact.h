// Where two bodies touch.
#pragma once
#include <algorithm>
#include <limits>

#include "penalty/contact/weighted_point.h"

namespace penalty {

/// One end of a contact or of a coupling: a point of the particles of a body, or a point fixed in a rigid body.
struct Side {
  int body = -1;                     // index into the bodies of the island; -1: a rigid body's
  int rigid = -1;                    // index into its rigid bodies
  WeightedPoint point = {};          // of the particles of `body`
  Vector3 anchor = Vector3::Zero();  // in the frame of the rigid body [m]

  static Side of_particles(int body, const WeightedPoint& point) { return {.body = body, .point = point}; }
  static Side of_rigid(int rigid, const Vector3& anchor) { return {.rigid = rigid, .anchor = anchor}; }
  bool is_rigid() const { return body < 0; }
};

/// What a contact gave in the last substeps, be they of the last step: where the next one starts from. What comes once,
/// as an impact does, does not come again.
class ContactMemory {
 public:
  bool is_empty() const { return !(normal_force_ > 0); }

  /// The impulse to start from, after forces have acted for `since` [s] from the last substep on [N s].
  Vector3 start(Real since) const { return since * share_ * force_; }

  /// Keeps `impulse` [N s], of forces that acted for `since` [s]; of none, as after damping, it says nothing.
  void keep(const Vector3& impulse, const Vector3& normal, Real since) {
    if (!(since > 0)) return;
    const Real before = normal_force_;
    force_ = impulse / since;
    normal_force_ = normal.dot(force_);
    share_ = normal_force_ > 0 ? std::clamp<Real>(before / normal_force_, 0, 1) : 0;
  }

 private:
  Vector3 force_ = Vector3::Zero();  // [N]
  Real normal_force_ = 0;            // [N]
  Real share_ = 0;                   // so that the start is no more than either of the last two gave along the normal
};

/// What a contact gave in a step.
struct ContactImpulse {
  Vector3 pressed = Vector3::Zero(), rubbed = Vector3::Zero();  // along the normals of the substeps, and across [N s]
  Real pressing = 0, sliding = 0;  // sizes along the normal, of all and of those with friction at its limit [N s]
  bool is_last = false;            // of the last substep, too

  bool is_none() const { return !(pressing > 0); }
  Vector3 sum() const { return pressed + rubbed; }

  /// That of a substep.
  void add(const Vector3& normal, Real along, const Vector3& across, bool is_at_limit) {
    pressed += along * normal;
    rubbed += across;
    pressing += along;
    if (is_at_limit) sliding += along;
    is_last = true;
  }
  void add(const ContactImpulse& other) {
    pressed += other.pressed;
    rubbed += other.rubbed;
    pressing += other.pressing;
    sliding += other.sliding;
    is_last = is_last || other.is_last;
  }
};

/// Whether friction of this size is all that Coulomb's law allows.
inline bool is_at_limit(Real size, Real most) {
  constexpr Real round_off = 1e-6;
  return size >= (1 - round_off) * most;
}

/// Which share of impulses to start from makes most of the approach go away: `before` and `after` are what they work
/// against it, before and after all are given. A start is never worse than none, so sweeps that end early gain no energy.
inline Real best_share(Real before, Real after) {
  return after > 0 ? std::clamp<Real>(before / (before - after), 0, 1) : 1;
}

/// The point of `a`, which belongs to particles, may not go below the plane through the point of `b` with unit normal
/// `normal`, which points from b to a; or, with a positive `radius`, not come closer to the point of b than that: the
/// surface of a ball. Where b is rigid the normal is fixed in its frame, else in the world.
struct Contact {
  Side a, b;
  Vector3 normal = Vector3::UnitY();
  Real radius = 0;    // of a ball about the point of b; zero: a plane [m]
  Real friction = 0;  // Coulomb coefficient
  Real deepest =
      std::numeric_limits<Real>::infinity();  // depth that is taken back; what is deeper stays where it is [m]

  ContactMemory memory = {};
  ContactImpulse given = {};  // in the step, to a
};

/// The point of `a`, which belongs to particles, is held at that of `b`, which is fixed in a rigid body.
struct Anchor {
  Side a, b;
  Real influence = 1;  // the share of what a substep would have to do, that it does: above zero, at most one
};

/// Where two rigid bodies touch, or may: the point of a may not go below the plane through the point of b.
struct RigidContact {
  int a = -1, b = -1;                                              // indices into the rigid bodies of the island
  Vector3 anchor_a = Vector3::Zero(), anchor_b = Vector3::Zero();  // in their frames [m]
  Vector3 normal = Vector3::UnitY();                               // from b to a, in the frame of b
  Real radius = 0;       // of a ball about the point of a, which then is its surface, whatever the ball turns [m]
  Real friction = 0;     // Coulomb coefficient
  Real restitution = 0;  // of speeds of approach; see Impact for soft bodies
  Real rolling = 0, spinning = 0;  // moments against turning across the normal and about it, by the force along it [m]

  // On a, of the last substep, be it of the last step: where the next starts from.
  Vector3 force = Vector3::Zero();   // [N]
  Vector3 moment = Vector3::Zero();  // against rolling and spinning [N m]
};

}  // namespace penalty
