// Where a body broke.
#pragma once
#include <vector>

#include "penalty/fields/potential_field.h"

namespace penalty {

BreakCount count_breaks(const PotentialField& field);

/// Elements that broke and have not been enabled again.
class BrokenElements {
 public:
  /// Of a body of as many particles: none yet.
  explicit BrokenElements(int num_particles) : stencils_of_(num_particles) {}
  /// All of a field.
  explicit BrokenElements(const PotentialField& field);

  /// Adds those of a potential over these particles.
  void add(const Potential& potential, const Positions& rest);

  bool empty() const { return num_broken_ == 0; }

  /// All particles of one of them are among these: a triangle with an edge that broke, a tetrahedron that did.
  bool cut(std::span<const int> particles) const;

 private:
  std::vector<std::vector<std::vector<int>>> stencils_of_;  // by the first of their particles
  std::size_t num_broken_ = 0;
};

}  // namespace penalty
