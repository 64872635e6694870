// The moving state of a body.
#pragma once
#include <span>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

/// Particles in packed arrays, in double whatever the world around them computes in. An inverse mass of zero pins a
/// particle: no force moves it, a velocity that somebody else gives it still does.
struct Particles {
  PackedVectors positions;           // [m]
  PackedVectors velocities;          // [m/s]
  std::vector<Real> inverse_masses;  // [1/kg]

  int size() const { return static_cast<int>(positions.cols()); }
};

Real kinetic_energy(const Particles& particles);                                         // [J]
Real kinetic_energy(const Vectors& velocities, std::span<const Real> inverse_masses);    // [J]
Vector3 linear_momentum(const Particles& particles);                                     // [kg m/s]
Vector3 angular_momentum(const Particles& particles, const Vector3& about = {0, 0, 0});  // [kg m²/s]

}  // namespace penalty
