#include "penalty/contact/box_tree.h"

#include <gtest/gtest.h>

#include "math/random.h"

namespace penalty::testing {
namespace {

std::vector<Box> random_boxes(int count, Random& random) {
  std::vector<Box> boxes(count);
  for (Box& box : boxes) {
    const Vector3 center = random.vector(1);
    box.add(center + random.vector(0.1));
    box.add(center + random.vector(0.1));
  }
  return boxes;
}

// Returns how many were found.
int expect_finds_what_overlaps(const BoxTree& tree, const std::vector<Box>& boxes, Random& random) {
  int hits = 0;
  for (int k = 0; k < 50; ++k) {
    const Box box = random_boxes(1, random).front();
    const Real reach = random.uniform(0, 0.2);
    std::vector<int> found, expected;
    tree.visit(box, reach, [&](int item) { found.push_back(item); });
    for (std::size_t i = 0; i < boxes.size(); ++i)
      if (boxes[i].overlaps(box, reach)) expected.push_back(static_cast<int>(i));
    hits += static_cast<int>(expected.size());
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
  }
  return hits;
}

TEST(BoxTree, FindsWhatOverlapsAlsoAfterTheBoxesMoved) {
  Random random(3);
  int hits = 0;
  for (const int count : {1, 2, 3, 64, 501}) {
    std::vector<Box> boxes = random_boxes(count, random);
    BoxTree tree(boxes);
    hits += expect_finds_what_overlaps(tree, boxes, random);
    boxes = random_boxes(count, random);
    tree.refit([&](int item) { return boxes[item]; });
    hits += expect_finds_what_overlaps(tree, boxes, random);
  }
  EXPECT_GT(hits, 100);
}

TEST(BoxTree, OfNothingFindsNothing) {
  const BoxTree tree{std::span<const Box>()};
  Box all;
  all.add(Vector3::Constant(-1e9));
  all.add(Vector3::Constant(1e9));
  tree.visit(all, 0, [](int) { FAIL(); });
}

TEST(BoxTree, OfBoxesAtOnePlaceKeepsThemAll) {
  Box box;
  box.add(Vector3(1, 2, 3));
  const std::vector<Box> boxes(100, box);
  int found = 0;
  BoxTree(boxes).visit(box, 0, [&](int) { ++found; });
  EXPECT_EQ(found, 100);
}

TEST(Box, KnowsItsGapToAnother) {
  Box a, b;
  a.add(Vector3(0, 0, 0));
  a.add(Vector3(1, 1, 1));
  b.add(Vector3(3, 0.5, 0.5));
  EXPECT_EQ(a.gap_to(b), 2);
  EXPECT_EQ(b.gap_to(a), 2);
  EXPECT_EQ(a.gap_to(a), 0);
}

}  // namespace
}  // namespace penalty::testing
