#include "penalty/stepping/particles.h"

namespace penalty {

Real kinetic_energy(const Particles& particles) {
  return kinetic_energy(particles.velocities, particles.inverse_masses);
}

Real kinetic_energy(const Vectors& velocities, std::span<const Real> inverse_masses) {
  Real sum = 0;
  for (std::size_t i = 0; i < inverse_masses.size(); ++i)
    if (inverse_masses[i] > 0)
      sum += velocities.col(static_cast<Eigen::Index>(i)).head<3>().squaredNorm() / inverse_masses[i];
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
