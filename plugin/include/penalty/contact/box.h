// An axis-aligned box.
#pragma once
#include <algorithm>
#include <limits>

#include "penalty/math/types.h"

namespace penalty {

/// Empty until a point is added.
struct Box {
  Vector3 low = Vector3::Constant(std::numeric_limits<Real>::infinity());
  Vector3 high = -low;

  void add(const Vector3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  void add(const Box& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  bool overlaps(const Box& other, Real padding) const {
    return ((low.array() - padding) <= other.high.array()).all() &&
           ((other.low.array() - padding) <= high.array()).all();
  }
  bool contains(const Vector3& p, Real padding) const {
    return ((low.array() - padding) <= p.array()).all() && ((high.array() + padding) >= p.array()).all();
  }
  /// A distance that points of the two boxes have at least; zero if the boxes overlap [m].
  Real gap_to(const Box& other) const {
    return std::max({Real(0), (other.low - high).maxCoeff(), (low - other.high).maxCoeff()});
  }
};

}  // namespace penalty
