// When a body is far from its rest shape: what a field of two phases goes by.
#pragma once
#include <span>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty {

class BrokenElements;

/// When a body counts as far from its rest shape: when the strain of some tetrahedron, max_k |s_k - 1| over its signed
/// principal stretches s_k, exceeds `enter`; and again as near when all have fallen below `leave`. An inverted
/// tetrahedron has a negative stretch, hence a strain above 1.
struct PhaseThresholds {
  Real enter = 0.9, leave = 0.3;
};

/// Says which of two phases the tetrahedra are in, with hysteresis. Those that broke have no say: what is left of them
/// may be anywhere.
class PhaseSwitch {
 public:
  /// Starts near rest. Throws std::invalid_argument for an index outside the rest positions, for a tetrahedron without
  /// volume and for thresholds that are not 0 < leave <= enter.
  PhaseSwitch(std::span<const Tetrahedron> tetrahedra, const Positions& rest, const PhaseThresholds& thresholds);

  bool is_far = false;

  /// Those that are cut are broken from now on, and no others.
  void set_broken(const BrokenElements& broken);
  bool any_broken() const { return !is_broken_.empty(); }
  /// Some tetrahedra hold all these particles, and all of them are broken.
  bool has_lost(std::span<const int> particles) const;

  /// Whether the tetrahedra are far at `x`, given whether they are now.
  bool looks_far(const Positions& x) const;

  /// Largest strain of a tetrahedron, as in PhaseThresholds.
  Real largest_strain(const Positions& x) const;

 private:
  bool is_broken(std::size_t t) const { return any_broken() && is_broken_[t]; }
  Matrix3 deformation_gradient(std::size_t t, const Positions& x) const;

  std::vector<Tetrahedron> tetrahedra_;
  std::vector<Matrix3> inverse_rest_;  // (edges from the first point)⁻¹ at rest [1/m]
  // Empty while none is broken.
  std::vector<bool> is_broken_;
  std::vector<std::vector<int>> around_;  // tetrahedra, of each particle
  PhaseThresholds thresholds_;
};

}  // namespace penalty
