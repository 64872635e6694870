// What a solver knows of the elastic world: an energy of the particle positions and its derivatives.
#pragma once
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "penalty/assembly/block_matrix.h"
#include "penalty/energy/penalty_energy.h"
#include "penalty/math/types.h"

namespace penalty {

/// A sum of element energies. Calls are virtual once a batch of elements, never per element. Arrays have one column a
/// particle and are never resized; functions that start with `add_` add to their output, the others overwrite it.
/// Positions that are not finite give results that are not finite, never an error.
class Potential {
 public:
  virtual ~Potential() = default;

  virtual std::string_view name() const = 0;
  virtual std::size_t num_elements() const = 0;

  virtual Real energy(const Positions& x) const = 0;  // [J]

  /// f += -dE/dx [N]; returns E [J], which costs next to nothing on the way.
  virtual Real add_forces(const Positions& x, Forces f) const = 0;

  /// f += damping forces along the constraint gradients, F = -(time * K) (dC . v) dC: `time` [s] is the ratio of damping
  /// to stiffness.
  virtual void add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const = 0;

  /// K += d²E/dx² [N/m], into a matrix whose pattern holds `append_pattern`.
  virtual void add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const = 0;
  virtual void append_pattern(std::vector<std::pair<int, int>>& pattern) const = 0;

  /// df += scale * (d²E/dx²) dx, without a matrix.
  virtual void add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                     Forces df) const = 0;

  /// diagonal += scale * the diagonal of the Gauss-Newton stiffness [N/m].
  virtual void add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const = 0;

  /// bounds[i] += sum_e K_e |dC/dp_i| sum_j |dC/dp_j|: the Gershgorin row sums of the Gauss-Newton stiffness [N/m]. The
  /// largest bounds[i] / m_i is never below the largest eigenvalue of M^-1 K.
  virtual void add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const = 0;

  /// Takes velocity along the constraint gradients away, implicitly and element by element, as F = -(time * K) (dC . v) dC
  /// acting for `duration` would. Each update is a pair of internal impulses: linear and angular momentum stay what they
  /// are, and kinetic energy only falls, for any duration. Particles of zero inverse mass keep their velocity.
  virtual void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                         Forces v) const = 0;

  /// Appends C of every element, in the order in which they were added.
  virtual void append_values(const Positions& x, std::vector<Real>& values) const = 0;
};

}  // namespace penalty
