// A point of a convex set is nearest to p if no corner of the set lies further towards p: (p - y) . (c - y) <= 0.
#include "penalty/contact/closest_points.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "math/random.h"

namespace penalty::testing {
namespace {

constexpr Real noise = 1e-12;

void expect_weights(const ClosestPoints& closest, const std::array<Vector3, 4>& points, int size_of_first) {
  Vector3 sum = Vector3::Zero();
  Real of_first = 0, of_second = 0;
  for (int k = 0; k < 4; ++k) {
    sum += closest.weights[k] * points[k];
    (k < size_of_first ? of_first : of_second) += closest.weights[k];
    EXPECT_GE(k < size_of_first ? closest.weights[k] : -closest.weights[k], -noise);
  }
  EXPECT_NEAR(of_first, 1, noise);
  EXPECT_NEAR(of_second, -1, noise);
  EXPECT_LT((sum - closest.difference).norm(), noise);
}

TEST(ClosestPoints, OfAPointAndATriangleAreNearest) {
  Random random(1);
  int interior = 0, sides = 0, corners = 0;
  for (int k = 0; k < 2000; ++k) {
    const std::array<Vector3, 4> x{random.vector(2), random.vector(1), random.vector(1), random.vector(1)};
    const ClosestPoints closest = closest_points_of_triangle(x[0], x[1], x[2], x[3]);
    expect_weights(closest, x, 1);
    const Vector3 y = x[0] - closest.difference;
    for (int c = 1; c < 4; ++c) ASSERT_LT(closest.difference.dot(x[c] - y), 1e-9) << "triangle " << k;
    const auto zeros = std::count(closest.weights.begin() + 1, closest.weights.end(), 0);
    EXPECT_EQ(closest.is_interior, zeros == 0);
    (zeros == 0 ? interior : zeros == 1 ? sides : corners) += 1;
  }
  EXPECT_GT(interior, 50);
  EXPECT_GT(sides, 100);
  EXPECT_GT(corners, 100);
}

TEST(ClosestPoints, OfTwoEdgesAreNearest) {
  Random random(2);
  int interior = 0, ends = 0;
  for (int k = 0; k < 2000; ++k) {
    const std::array<Vector3, 4> x{random.vector(1), random.vector(1), random.vector(1), random.vector(1)};
    const ClosestPoints closest = closest_points_of_edges(x[0], x[1], x[2], x[3]);
    expect_weights(closest, x, 2);
    const Vector3 one = closest.weights[0] * x[0] + closest.weights[1] * x[1], two = one - closest.difference;
    for (const int c : {0, 1}) ASSERT_LT(-closest.difference.dot(x[c] - one), 1e-9) << "edges " << k;
    for (const int c : {2, 3}) ASSERT_LT(closest.difference.dot(x[c] - two), 1e-9) << "edges " << k;
    (closest.is_interior ? interior : ends) += 1;
  }
  EXPECT_GT(interior, 100);
  EXPECT_GT(ends, 100);
}

TEST(ClosestPoints, OfParallelEdgesAreNearestThoughNotUnique) {
  const ClosestPoints closest = closest_points_of_edges({0, 0, 0}, {1, 0, 0}, {0.2, 0.3, 0}, {1.2, 0.3, 0});
  EXPECT_NEAR(closest.difference.norm(), 0.3, noise);
  EXPECT_FALSE(closest.is_interior);
}

TEST(ClosestPoints, OfWhatHasNoSizeAreFiniteAndNearest) {
  const Vector3 o(0, 0, 0), x(1, 0, 0);
  EXPECT_NEAR(closest_points_of_edges(o, o, x, x).difference.norm(), 1, noise);
  EXPECT_NEAR(closest_points_of_edges(o, o, {1, -1, 0}, {1, 1, 0}).difference.norm(), 1, noise);
  EXPECT_NEAR(closest_points_of_edges({1, -1, 0}, {1, 1, 0}, o, o).difference.norm(), 1, noise);
  EXPECT_NEAR(closest_points_of_triangle(x, o, o, o).difference.norm(), 1, noise);
  EXPECT_NEAR(closest_points_of_triangle({0, 1, 0}, {-1, 0, 0}, {2, 0, 0}, {0.5, 0, 0}).difference.norm(), 1, noise);
  EXPECT_NEAR(closest_points_of_triangle(o, o, {1, 0, 0}, {0, 1, 0}).difference.norm(), 0, noise);
}

}  // namespace
}  // namespace penalty::testing
