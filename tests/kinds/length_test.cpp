#include "penalty/kinds/length.h"

#include "kinds/samples.h"

namespace penalty::testing {
namespace {

Points<2> segment(const Vector3& p0, const Vector3& p1) {
  Points<2> p;
  p << p0, p1;
  return p;
}

TEST(Length, IsTheRelativeChangeOfLength) {
  const Length length = Length::at_rest(segment({0, 0, 0}, {0, 0, 2}));
  EXPECT_DOUBLE_EQ(length.rest_length(), 2);
  EXPECT_DOUBLE_EQ(length.value(segment({0, 0, 0}, {3, 0, 0})), 0.5);
  EXPECT_DOUBLE_EQ(length.value(segment({0, 1, 0}, {0, 0, 0})), -0.5);
  EXPECT_DOUBLE_EQ(length.value(segment({1, 1, 1}, {1, 1, 1})), -1);
}

TEST(Length, GradientIsTheUnitDirectionOverTheRestLength) {
  const Length length = Length::at_rest(segment({0, 0, 0}, {0, 0, 2}));
  EXPECT_LT((length.gradient(segment({1, 0, 0}, {4, 4, 0})) - segment({-0.3, -0.4, 0}, {0.3, 0.4, 0})).norm(), 1e-15);
}

TEST(Length, CoincidentPointsArePushedApartAlongTheRestDirection) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto s = sample<Length>(seed);
    SCOPED_TRACE(trace(s));
    const Vector3 edge = s.rest.col(1) - s.rest.col(0);
    const Vector3 expected = edge / edge.squaredNorm();  // n / L0
    for (const Real distance : {0.0, 0.9e-9}) {          // of the rest length
      const Vector3 p0 = s.size * Vector3(0.3, 0.2, 0.1);
      // One coordinate only, at the origin, so that the distance survives rounding.
      const Points<2> points = distance == 0 ? segment(p0, p0) : segment({0, 0, 0}, {0, distance * edge.norm(), 0});
      const Gradient<2> gradient = s.kind.gradient(points);
      EXPECT_LT((gradient.col(1) - expected).norm(), 1e-7 * expected.norm());  // the direction is kept in float
      EXPECT_EQ(gradient.col(0), -gradient.col(1));
      EXPECT_LT(s.kind.value(points), -0.99);  // compressed: -K C dC/dp1 points along +n
      EXPECT_TRUE(s.kind.hessian(points).isZero(0));
    }
  }
}

TEST(Length, NearlyCoincidentPointsKeepTheirOwnDirection) {
  const Length length = Length::at_rest(segment({0, 0, 0}, {0, 0, 2}));
  EXPECT_LT((length.gradient(segment({0, 0, 0}, {4e-9, 0, 0})) - segment({-0.5, 0, 0}, {0.5, 0, 0})).norm(), 1e-15);
}

TEST(Length, RefusesAZeroRestLengthByName) {
  EXPECT_EQ(complaint<std::invalid_argument>([] { Length::at_rest(segment({1, 2, 3}, {1, 2, 3})); }),
            "length: rest length is 0");
}

}  // namespace
}  // namespace penalty::testing
