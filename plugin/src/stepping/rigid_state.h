// What particles that nothing holds have of a rigid body.
#pragma once
#include "penalty/stepping/particles.h"

namespace penalty {

/// Mass, centre, momenta and inertia.
struct RigidState {
  Real mass = 0;
  Vector3 center = Vector3::Zero(), momentum = Vector3::Zero();
  Vector3 spin = Vector3::Zero();     // angular momentum about the centre [kg m²/s]
  Matrix3 inertia = Matrix3::Zero();  // about the centre [kg m²]

  RigidState() = default;
  explicit RigidState(const Particles& particles)
      : RigidState(particles.positions, particles.velocities, particles.inverse_masses) {}
  RigidState(const Positions& positions, const Positions& velocities, std::span<const Real> inverse_masses);

  /// About a line that all particles are on there is no moment, and no inverse.
  Matrix3 inverse_inertia() const;

  /// The angular velocity of least energy with an angular momentum [rad/s].
  Vector3 angular_velocity(const Vector3& angular_momentum) const { return inverse_inertia() * angular_momentum; }

  /// Of the rigid motion [J].
  Real kinetic_energy() const { return (momentum.squaredNorm() / mass + spin.dot(angular_velocity(spin))) / 2; }
};

}  // namespace penalty
