// A point between particles.
#pragma once
#include <array>
#include <span>
#include <string>

#include "penalty/math/types.h"

namespace penalty {

/// Up to four particles and their weights, which sum to one: a particle, a point of an edge, of a face, of a
/// tetrahedron, or of a surface that a lattice of tetrahedra carries along.
struct WeightedPoint {
  std::array<int, 4> particles{};
  std::array<Real, 4> weights{};
  int size = 0;

  bool operator==(const WeightedPoint&) const = default;

  static WeightedPoint at_particle(int particle) { return {{particle}, {1}, 1}; }

  /// Throws std::invalid_argument, beginning with `what`, unless there are one to four particles, all among
  /// `num_particles`, no two of them the same, and their weights are finite and sum to one.
  void check(int num_particles, const std::string& what) const;

  /// What `vectors`, one column a particle from `first` on, say of the point.
  Vector3 of(const PackedVectors& vectors, Eigen::Index first = 0) const {
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < size; ++k)
      sum += weights[k] * Eigen::Map<const Vector3>(vectors.data() + 4 * (first + particles[k]));
    return sum;
  }
  Vector3 of(const Vectors& vectors) const = delete;  // would copy them all, at every call

  /// Inverse of the mass that an impulse on the point meets [1/kg].
  Real mobility(std::span<const Real> inverse_masses) const {
    Real sum = 0;
    for (int k = 0; k < size; ++k) sum += weights[k] * weights[k] * inverse_masses[particles[k]];
    return sum;
  }

  /// Gives each particle its share of a push on the point: weight * inverse mass * push.
  void add_push(const Vector3& push, std::span<const Real> inverse_masses, PackedVectors& vectors) const {
    for (int k = 0; k < size; ++k)
      Eigen::Map<Vector3>(vectors.data() + 4 * particles[k]) += weights[k] * inverse_masses[particles[k]] * push;
  }
};

}  // namespace penalty
