// A rigid body as the sub-cycle sees it.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Position, velocity and what contacts and couplings do to them in one step. Zero inverse mass and inertia: a static or
/// kinematic obstacle, which moves with its velocities and takes no impulse.
struct RigidBody {
  Vector3 position = Vector3::Zero();          // centre of mass [m]
  Matrix3 rotation = Matrix3::Identity();      // body to world
  Vector3 velocity = Vector3::Zero();          // [m/s]
  Vector3 angular_velocity = Vector3::Zero();  // world [rad/s]
  Vector3 inverse_mass = Vector3::Zero();      // along the world axes [1/kg]
  Matrix3 inverse_inertia = Matrix3::Zero();   // world, at `rotation` [1/(kg m²)]
  Vector3 acceleration = Vector3::Zero();      // that acts besides the contacts: gravity, other contacts [m/s²]

  Vector3 impulse = Vector3::Zero();          // that it was given, summed [N s]
  Vector3 angular_impulse = Vector3::Zero();  // about the centre of mass [N m s]
  Vector3 turn = Vector3::Zero();             // integral of the angular velocity [rad]

  bool is_dynamic() const { return !inverse_mass.isZero(0) || !inverse_inertia.isZero(0); }

  bool is_at_rest() const { return !is_dynamic() && velocity.isZero(0) && angular_velocity.isZero(0); }

  /// It takes impulses and moments in every direction.
  bool is_free() const;

  /// Of the point at `arm` from the centre of mass, along the world axes [m]: velocity [m/s].
  Vector3 velocity_at(const Vector3& arm) const { return velocity + angular_velocity.cross(arm); }

  /// Changes of the velocity at `arm`, by columns, by unit impulses there [1/kg].
  Matrix3 mobility_at(const Vector3& arm) const {
    Matrix3 cross;  // cross * x = arm x x
    cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    Matrix3 mobility = cross.transpose() * (inverse_inertia * cross);
    mobility.diagonal() += inverse_mass;
    return mobility;
  }

  /// Gives it an impulse [N s] at `arm`, booked in `impulse` and `angular_impulse`. Returns its work [J].
  Real push(const Vector3& given, const Vector3& arm) {
    const Vector3 moment = arm.cross(given);
    const Vector3 dv = inverse_mass.cwiseProduct(given), dw = inverse_inertia * moment;
    const Real work = given.dot(velocity + dv / 2) + moment.dot(angular_velocity + dw / 2);
    velocity += dv;
    angular_velocity += dw;
    impulse += given;
    angular_impulse += moment;
    return work;
  }

  /// Gives a free body these velocities [m/s], [rad/s], booked like a push.
  void set_motion(const Vector3& new_velocity, const Vector3& new_angular_velocity);

  /// Moves the body for `duration` [s] at its velocities.
  void drift(Real duration);
};

Real kinetic_energy(const RigidBody& body);  // [J]

}  // namespace penalty
