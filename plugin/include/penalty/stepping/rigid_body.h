// A rigid body as the sub-cycle sees it.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Position, velocity and what the contacts of one step do to them. Zero inverse mass and inertia: a static or
/// kinematic obstacle, which moves with its velocities and takes no impulse.
struct RigidBody {
  Vector3 position = Vector3::Zero();          // centre of mass [m]
  Matrix3 rotation = Matrix3::Identity();      // body to world
  Vector3 velocity = Vector3::Zero();          // [m/s]
  Vector3 angular_velocity = Vector3::Zero();  // world [rad/s]
  Vector3 inverse_mass = Vector3::Zero();      // along the world axes [1/kg]
  Matrix3 inverse_inertia = Matrix3::Zero();   // world, at `rotation` [1/(kg m²)]
  Vector3 acceleration = Vector3::Zero();      // that acts besides the contacts: gravity, other contacts [m/s²]

  Vector3 impulse = Vector3::Zero();          // of the soft contacts, summed [N s]
  Vector3 angular_impulse = Vector3::Zero();  // about the centre of mass [N m s]
  Vector3 turn = Vector3::Zero();             // integral of the angular velocity [rad]

  bool is_dynamic() const { return !inverse_mass.isZero(0) || !inverse_inertia.isZero(0); }
  Vector3 velocity_at(const Vector3& arm) const { return velocity + angular_velocity.cross(arm); }

  /// Moves the body for `duration` [s] at its velocities.
  void drift(Real duration);
};

Real kinetic_energy(const RigidBody& body);  // [J]

}  // namespace penalty
