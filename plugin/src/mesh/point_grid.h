// Finds points near a place: a hash of cubic cells.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

class PointGrid {
 public:
  /// Points closer than `reach` are found; `origin` should lie near the points. reach > 0. [m]
  PointGrid(const Vector3& origin, Real reach) : origin_(origin), reach_(reach) {}

  void add(const Vector3& point, int number) { cells_[key(cell_of(point))].push_back({point, number}); }

  /// The lowest number among the points closer than `reach` to `place`, -1 if there is none.
  int nearby(const Vector3& place) const {
    int lowest = -1;
    const Cell low = cell_of(place.array() - reach_), high = cell_of(place.array() + reach_);
    Cell cell;
    for (cell[0] = low[0]; cell[0] <= high[0]; ++cell[0])
      for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1])
        for (cell[2] = low[2]; cell[2] <= high[2]; ++cell[2]) {
          const auto found = cells_.find(key(cell));
          if (found == cells_.end()) continue;
          for (const Entry& entry : found->second)
            if ((lowest < 0 || entry.number < lowest) && (entry.point - place).squaredNorm() < reach_ * reach_)
              lowest = entry.number;
        }
    return lowest;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Entry {
    Vector3 point;
    int number;
  };

  Cell cell_of(const Vector3& point) const {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      // Beyond 2^40 cells a coordinate has no digits left for a reach of one cell: clamping only avoids overflow.
      constexpr Real limit = 0x1p40;
      // Twice the reach: a neighbourhood then meets few cells, as a rule one to eight.
      const Real place = std::floor((point[axis] - origin_[axis]) / (2 * reach_));
      cell[axis] = static_cast<std::int64_t>(std::fmin(std::fmax(place, -limit), limit));
    }
    return cell;
  }

  // Cells may share a key: distances decide.
  static std::uint64_t key(const Cell& cell) {
    return static_cast<std::uint64_t>(cell[0]) * 0x9E3779B97F4A7C15u ^
           static_cast<std::uint64_t>(cell[1]) * 0xC2B2AE3D27D4EB4Fu ^
           static_cast<std::uint64_t>(cell[2]) * 0x165667B19E3779F9u;
  }

  Vector3 origin_;
  Real reach_;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
};

}  // namespace penalty
