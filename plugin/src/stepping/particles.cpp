#include "penalty/stepping/particles.h"

namespace penalty {

Real kinetic_energy(const Particles& particles) {
  Real sum = 0;
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] > 0)
      sum += particles.velocities.col(i).head<3>().squaredNorm() / particles.inverse_masses[i];
  return sum / 2;
}

Vector3 linear_momentum(const Particles& particles) {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] > 0) sum += particles.velocities.col(i).head<3>() / particles.inverse_masses[i];
  return sum;
}

Vector3 angular_momentum(const Particles& particles, const Vector3& about) {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] > 0) {
      const Vector3 arm = particles.positions.col(i).head<3>() - about;
      sum += arm.cross(particles.velocities.col(i).head<3>()) / particles.inverse_masses[i];
    }
  return sum;
}

}  // namespace penalty
