// What a solver knows of the elastic world: an energy of the particle positions and its derivatives.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "penalty/energy/penalty_energy.h"
#include "penalty/fields/block_matrix.h"
#include "penalty/math/types.h"

namespace penalty {

/// A part of the stiffness that is too dense for a block matrix: coefficient * d dᵀ, column k of d belongs to particles[k].
struct RankOneTerm {
  Real coefficient;  // of either sign
  std::vector<int> particles;
  Points<dynamic> direction;
};

/// A line of the energy ledger: one batch of elements at one instant. Strains are those that are resisted: C less target and
/// free play.
struct LedgerEntry {
  std::string name;
  std::size_t num_elements = 0, num_enabled = 0;
  Real energy = 0;                           // [J]
  Real mean_strain = 0, largest_strain = 0;  // of |strain|, over the enabled elements
  int largest_element = -1;                  // where it is largest
};

/// A sum of element energies. Calls are virtual once a batch of elements, never per element. Arrays have one column a
/// particle and are never resized; functions that start with `add_` add to their output, the others overwrite it.
/// Positions that are not finite give results that are not finite, never an error. One thread at a time may use a potential:
/// elements of many points keep scratch space.
class Potential {
 public:
  virtual ~Potential() = default;

  virtual std::string_view name() const = 0;
  virtual std::size_t num_elements() const = 0;

  virtual Real energy(const Positions& x) const = 0;  // [J]

  /// f += -dE/dx [N]; returns E [J], which costs next to nothing on the way.
  virtual Real add_forces(const Positions& x, Forces f) const = 0;

  /// f += damping forces along the constraint gradients, F = -(time * K) (dC . v) dC: `time` [s] is the ratio of damping
  /// to stiffness, to which elements with a damping time of their own add it.
  virtual void add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const = 0;

  /// K += d²E/dx² [N/m], into a matrix whose pattern holds `append_pattern`, but for the terms of `append_rank_one_terms`:
  /// elements of many points couple all of them with each other.
  virtual void add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const = 0;
  virtual void append_pattern(std::vector<std::pair<int, int>>& pattern) const = 0;
  virtual void append_rank_one_terms(const Positions& x, StiffnessModel model,
                                     std::vector<RankOneTerm>& terms) const = 0;

  /// df += scale * (d²E/dx²) dx, without a matrix and with nothing left out.
  virtual void add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                     Forces df) const = 0;

  /// diagonal += scale * the diagonal of the Gauss-Newton stiffness [N/m].
  virtual void add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const = 0;

  /// bounds[i] += sum_e K_e |dC/dp_i| sum_j |dC/dp_j|: the Gershgorin row sums of the taut Gauss-Newton stiffness [N/m]. The
  /// largest bounds[i] / m_i is never below the largest eigenvalue of M^-1 K.
  virtual void add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const = 0;

  /// Takes velocity along the constraint gradients away, implicitly and element by element, as F = -(time * K) (dC . v) dC
  /// acting for `duration` would. Each update is a set of internal impulses: linear and angular momentum stay what they
  /// are, and kinetic energy only falls, for any duration. Particles of zero inverse mass keep their velocity.
  virtual void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                         Forces v) const = 0;

  /// D += the damping matrix [N s/m] of `add_damping_forces`, F = -D v, but for the terms of `append_damping_terms`; the
  /// pattern is that of the stiffness.
  virtual void add_damping(const Positions& x, Real time, BlockMatrix& damping) const = 0;
  virtual void append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const = 0;

  /// Some elements have a damping time of their own: `dissipate` has work to do even at time 0.
  virtual bool damps() const = 0;

  /// Plastic flow and breaking over `duration` [s], judged at `x`; returns the elastic energy that this took [J]. State
  /// is what `evolve` changes: a solver that repeats a step saves it before and restores it.
  virtual bool evolves() const = 0;  // there may be something to do
  virtual Real evolve(const Positions& x, Real duration) = 0;
  virtual void save_state() = 0;
  virtual void restore_state() = 0;

  /// A potential of several phases chooses the one for `x`, before a step; returns the energy that this added [J]. Phases are
  /// part of the state.
  virtual Real choose_phase(const Positions& /*x*/) { return 0; }

  /// Grows with every change that may raise the stiffness: what was estimated from it is then out of date.
  virtual std::uint64_t stiffness_version() const = 0;

  /// Appends the resisted strain of every element, C less target and free play, in the order in which they were added; 0
  /// where it is disabled.
  virtual void append_strains(const Positions& x, std::vector<Real>& strains) const = 0;

  /// Appends the energy of every element, in the same order [J].
  virtual void append_energies(const Positions& x, std::vector<Real>& energies) const = 0;

  /// energies[i] += the share of particle i in the energy of each of its elements: equal shares for all of its points [J].
  virtual void add_particle_energies(const Positions& x, std::span<Real> energies) const = 0;

  /// Appends one entry a batch.
  virtual void append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const = 0;
};

}  // namespace penalty
