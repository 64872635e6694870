#include "penalty/kinds/triangle_area.h"

#include "kinds/samples.h"
#include "math/eigenvalues.h"

namespace penalty::testing {
namespace {

Points<3> triangle(const Vector3& p0, const Vector3& p1, const Vector3& p2) {
  Points<3> p;
  p << p0, p1, p2;
  return p;
}

// Legs 3 and 4 along x and y: area 6.
Points<3> right_triangle() { return triangle({0, 0, 0}, {3, 0, 0}, {0, 4, 0}); }

TEST(TriangleArea, IsTheRelativeChangeOfArea) {
  const TriangleArea area = TriangleArea::at_rest(right_triangle());
  EXPECT_DOUBLE_EQ(area.rest_area(), 6);
  EXPECT_DOUBLE_EQ(TriangleArea::area(triangle({0, 0, 1}, {0, 2, 1}, {1, 0, 1})), 1);
  EXPECT_DOUBLE_EQ(area.value(2 * right_triangle()), 3);
  EXPECT_DOUBLE_EQ(area.value(triangle({0, 0, 0}, {3, 0, 0}, {17, 2, 0})), -0.5);  // only the height counts
  EXPECT_DOUBLE_EQ(area.value(triangle({0, 0, 0}, {0, 4, 0}, {3, 0, 0})), 0);      // the other orientation
  EXPECT_DOUBLE_EQ(area.value(triangle({1, 1, 1}, {1, 1, 1}, {2, 2, 2})), -1);
}

TEST(TriangleArea, AgreesWithHerons) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TriangleArea>(seed);
    const Real a = (s.points.col(2) - s.points.col(1)).norm(), b = (s.points.col(0) - s.points.col(2)).norm(),
               c = (s.points.col(1) - s.points.col(0)).norm(), half = (a + b + c) / 2;
    const Real heron = std::sqrt(half * (half - a) * (half - b) * (half - c));
    error.see(std::abs(TriangleArea::area(s.points) - heron) / heron, seed);
  }
  error.expect_below(1e-12, "relative error");
}

TEST(TriangleArea, GradientOfAPointIsHalfTheOppositeEdgeAcrossIt) {
  // A = x1 y2 / 2 for these points: dA/dx1 = 2, dA/dy2 = 3/2; over A0 = 6.
  const Gradient<3> gradient = TriangleArea::at_rest(right_triangle()).gradient(right_triangle());
  EXPECT_LT((gradient - triangle({-1.0 / 3, -0.25, 0}, {1.0 / 3, 0, 0}, {0, 0.25, 0})).norm(), 1e-15);
}

TEST(TriangleArea, HessianHasTheEigenvaluesOfTheClosedForm) {
  // Of A: +-sqrt(3)/2 twice each and 0 twice in the plane; out of it those of the Gram matrix of the edges over 4A.
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto s = sample<TriangleArea>(seed);
    SCOPED_TRACE(trace(s));
    Matrix3 edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = s.points.col((i + 2) % 3) - s.points.col((i + 1) % 3);
    const Matrix3 gram = edges.transpose() * edges / (4 * TriangleArea::area(s.points));
    const Vector3 across = symmetric_eigenvalues(gram);
    const Real r = std::sqrt(3.0) / 2;
    Eigen::Vector<Real, 9> expected{-r, -r, r, r, 0, 0, across[0], across[1], across[2]};
    std::sort(expected.begin(), expected.end());
    const Hessian<3> hessian = s.kind.hessian(s.points) * s.kind.rest_area();
    const Eigen::Vector<Real, 9> actual = symmetric_eigenvalues(hessian);
    EXPECT_LT((actual - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST(TriangleArea, CollapsedOntoALineItOpensAcrossTheNormalAtRest) {
  const TriangleArea area = TriangleArea::at_rest(right_triangle());
  const Points<3> line = triangle({0, 0, 0}, {6, 0, 0}, {2, 0, 0});
  const Gradient<3> gradient = area.gradient(line);
  // n = z: dA/dp2 = n x e2 / 2 with e2 = (6, 0, 0).
  EXPECT_LT((gradient.col(2) - Vector3(0, 0.5, 0)).norm(), 1e-15);
  EXPECT_TRUE(area.hessian(line).isZero(0));
  EXPECT_EQ(area.value(line), -1);
  Points<3> opened = line;
  opened += 0.1 * gradient;
  EXPECT_GT(area.value(opened), -1);
}

TEST(TriangleArea, ACollapsedTriangleHasNoNetForceAndNoNetTorqueEither) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const auto s = sample<TriangleArea>(seed);
    const Vector3 place = Random(seed).vector(1), along = Random(seed + 1).direction();
    const Points<3> line = s.size * triangle(place, place + 0.7 * along, place - 0.4 * along);
    const Gradient<3> gradient = s.kind.gradient(line);
    force.see(net_force<3>(gradient), seed);
    torque.see(net_torque<3>(line, gradient), seed);
    EXPECT_GT(gradient.norm() * s.size, 1e-3) << trace(s);
  }
  force.expect_below(1e-14, "net force");
  torque.expect_below(1e-14, "net torque");
}

TEST(TriangleArea, AThinTriangleKeepsItsOwnNormal) {
  // 1e-7 of its length high, in the plane across the one it had at rest.
  const TriangleArea area = TriangleArea::at_rest(right_triangle());
  const Gradient<3> gradient = area.gradient(triangle({0, 0, 0}, {6, 0, 0}, {2, 0, 6e-7}));
  EXPECT_LT((gradient.col(2) - Vector3(0, 0, 0.5)).norm(), 1e-15);
}

TEST(TriangleArea, CoincidentPointsHaveNoGradient) {
  EXPECT_TRUE(TriangleArea::at_rest(right_triangle()).gradient(Points<3>::Ones()).isZero(0));
}

TEST(TriangleArea, RefusesLinesByName) {
  EXPECT_EQ(complaint<std::invalid_argument>([] { TriangleArea::at_rest(triangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0})); }),
            "triangle area: rest area is 0");
  EXPECT_EQ(
      complaint<std::invalid_argument>([] { TriangleArea::at_rest(triangle({0, 0, 0}, {1, 0, 0}, {2, 2e-9, 0})); }),
      "triangle area: rest area is 1e-09, next to nothing for its edges");
}

}  // namespace
}  // namespace penalty::testing
