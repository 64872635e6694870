// Where a body broke.
#pragma once
#include <vector>

#include "penalty/fields/potential_field.h"

namespace penalty {

/// How many elements broke, and how many of them are still out of the field: while neither changes, no more did.
struct BreakCount {
  std::size_t ever = 0, now = 0;

  bool operator==(const BreakCount&) const = default;
};

BreakCount count_breaks(const PotentialField& field);

/// The elements of a field that broke and have not been enabled again.
class BrokenElements {
 public:
  explicit BrokenElements(const PotentialField& field);

  bool empty() const { return num_broken_ == 0; }

  /// All particles of one of them are among these: a triangle with an edge that broke, a tetrahedron that did.
  bool cut(std::span<const int> particles) const;

 private:
  std::vector<std::vector<std::vector<int>>> stencils_of_;  // by the first of their particles
  std::size_t num_broken_ = 0;
};

}  // namespace penalty
