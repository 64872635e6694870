#include "penalty/contact/box_tree.h"

#include <numeric>

#include "halves.h"

namespace penalty {

BoxTree::BoxTree(std::span<const Box> boxes) {
  if (boxes.empty()) return;
  std::vector<Vector3> centers;
  centers.reserve(boxes.size());
  for (const Box& box : boxes) centers.emplace_back((box.low + box.high) / 2);
  std::vector<int> items(boxes.size());
  std::iota(items.begin(), items.end(), 0);
  nodes_.reserve(2 * boxes.size());
  split(items, centers);
  refit([&](int item) { return boxes[item]; });
}

void BoxTree::split(std::span<int> items, std::span<const Vector3> centers) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  if (items.size() == 1) {
    nodes_[self].item = items.front();
  } else {
    const std::size_t middle = halve(items, centers);
    split(items.first(middle), centers);
    split(items.subspan(middle), centers);
  }
  nodes_[self].next = nodes_.size();
}

}  // namespace penalty
