// How sets of places are cut in two.
#pragma once
#include <algorithm>
#include <span>

#include "penalty/contact/box.h"

namespace penalty {

/// Reorders items so that the first half lies before the second along the longest side of the box of their centres,
/// and returns where the second begins. Ties go by number: the result depends on nothing else.
inline std::size_t halve(std::span<int> items, std::span<const Vector3> centers) {
  Box box;
  for (const int item : items) box.add(centers[item]);
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const std::size_t middle = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(), [&](int i, int j) {
    return centers[i][axis] != centers[j][axis] ? centers[i][axis] < centers[j][axis] : i < j;
  });
  return middle;
}

}  // namespace penalty
