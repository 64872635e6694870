// A tree of boxes whose topology stays and whose boxes follow what they hold.
#pragma once
#include <span>
#include <vector>

#include "penalty/contact/box.h"

namespace penalty {

class BoxTree {
 public:
  BoxTree() = default;

  /// Over items 0 .. n-1, halved again and again along the longest side of the box of their centres.
  explicit BoxTree(std::span<const Box> boxes);

  /// Boxes anew: box_of(item).
  template <class BoxOf>
  void refit(const BoxOf& box_of) {
    for (std::size_t k = nodes_.size(); k-- > 0;) {
      Node& node = nodes_[k];
      if (node.item >= 0) {
        node.box = box_of(node.item);
      } else {
        node.box = nodes_[k + 1].box;
        node.box.add(nodes_[nodes_[k + 1].next].box);
      }
    }
  }

  /// Calls visit(item) for each item whose box comes within `reach` [m] of `box`, always in the same order.
  template <class Visit>
  void visit(const Box& box, Real reach, const Visit& visit) const {
    for (std::size_t k = 0; k < nodes_.size();) {
      const Node& node = nodes_[k];
      if (!node.box.overlaps(box, reach)) {
        k = node.next;
      } else {
        if (node.item >= 0) visit(node.item);
        ++k;
      }
    }
  }

 private:
  struct Node {  // in depth-first order: the first child follows its parent
    Box box;
    std::size_t next = 0;  // the node after all that is below
    int item = -1;         // of a leaf
  };

  void split(std::span<int> items, std::span<const Vector3> centers);

  std::vector<Node> nodes_;
};

}  // namespace penalty
