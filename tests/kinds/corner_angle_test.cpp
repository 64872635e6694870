#include "penalty/kinds/corner_angle.h"

#include <limits>
#include <numbers>

#include "kinds/samples.h"
#include "math/eigenvalues.h"

namespace penalty::testing {
namespace {

using std::numbers::pi;

// p0 in (1, 2, 3), a leg of length `u` along x and one of length `v` at `angle` from it.
Points<3> corner(Real angle, Real u = 2, Real v = 0.5) {
  Points<3> p;
  p << Vector3(0, 0, 0), Vector3(u, 0, 0), Vector3(v * std::cos(angle), v * std::sin(angle), 0);
  return p.colwise() + Vector3(1, 2, 3);
}

TEST(CornerAngle, IsTheChangeOfTheAngleInRadians) {
  const CornerAngle kind = CornerAngle::at_rest(corner(pi / 3));
  EXPECT_DOUBLE_EQ(kind.rest_angle, pi / 3);
  for (const Real angle : {0.0, 0.01, 1.0, pi / 2, 3.0, pi})
    EXPECT_NEAR(kind.value(corner(angle)), angle - pi / 3, 1e-14);
  EXPECT_NEAR(kind.value(corner(1, 40, 1e-3)), 1 - pi / 3, 1e-12);  // the lengths of the legs do not count
  EXPECT_NEAR(kind.value(corner(-pi / 3)), 0, 1e-14);               // the mirror image is at rest
}

TEST(CornerAngle, OfTheThreeFourFiveTriangle) {
  Points<3> p;
  p << Vector3(0, 0, 0), Vector3(3, 0, 0), Vector3(0, 0, 4);
  EXPECT_DOUBLE_EQ(CornerAngle::angle(p), pi / 2);
  Points<3> from_p1;
  from_p1 << p.col(1), p.col(2), p.col(0);
  EXPECT_DOUBLE_EQ(CornerAngle::angle(from_p1), std::atan2(4, 3));
}

TEST(CornerAngle, AnglesOfATriangleMakeHalfATurn) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<CornerAngle>(seed);
    Real sum = 0;
    for (int k = 0; k < 3; ++k) {
      Points<3> turned;
      turned << s.points.col(k), s.points.col((k + 1) % 3), s.points.col((k + 2) % 3);
      sum += CornerAngle::angle(turned);
    }
    error.see(std::abs(sum - pi), seed);
  }
  error.expect_below(1e-13, "sum of the angles");
}

TEST(CornerAngle, GradientTurnsEachLegAtOneOverItsLength) {
  const CornerAngle kind = CornerAngle::at_rest(corner(1));
  for (const Real angle : {0.2, 1.0, 2.9}) {
    const Gradient<3> gradient = kind.gradient(corner(angle));
    EXPECT_LT((gradient.col(1) - Vector3(0, -0.5, 0)).norm(), 1e-14);
    EXPECT_LT((gradient.col(2) - 2 * Vector3(-std::sin(angle), std::cos(angle), 0)).norm(), 1e-14);
  }
}

TEST(CornerAngle, HessianHasTheEigenvaluesOfTheClosedForm) {
  // In (u, v): +-1/|u|² and +-1/|v|² in the plane of the legs; out of it those of
  // [[cot/|u|², -1/(|u||v| sin)], [-1/(|u||v| sin), cot/|v|²]].
  const Real length_u = 2, length_v = 0.5, angle = 1.1;
  const Hessian<3> hessian = CornerAngle::at_rest(corner(1)).hessian(corner(angle, length_u, length_v));
  const Real u = 1 / length_u, v = 1 / length_v, cotangent = 1 / std::tan(angle);
  Eigen::Matrix<Real, 2, 2> across;
  across << cotangent * u * u, -u * v / std::sin(angle), -u * v / std::sin(angle), cotangent * v * v;
  const Eigen::Vector<Real, 2> out = symmetric_eigenvalues(across);
  Eigen::Vector<Real, 6> expected{-u * u, u * u, -v * v, v * v, out[0], out[1]};
  std::sort(expected.begin(), expected.end());
  const Eigen::Matrix<Real, 6, 6> legs = hessian.bottomRightCorner<6, 6>();
  const Eigen::Vector<Real, 6> actual = symmetric_eigenvalues(legs);
  EXPECT_LT((actual - expected).norm(), 1e-13 * expected.norm());
}

TEST(CornerAngle, HasNoGradientAtStraightAndClosedCornersNorWithoutALeg) {
  const CornerAngle kind = CornerAngle::at_rest(corner(1));
  for (const Points<3>& p : {corner(0), corner(pi), corner(1, 0), corner(1, 2, 0), corner(1, 0, 0), corner(0.9e-8)}) {
    EXPECT_TRUE(std::isfinite(kind.value(p)));
    EXPECT_TRUE(kind.gradient(p).isZero(0)) << p;
    EXPECT_TRUE(kind.hessian(p).isZero(0)) << p;
  }
  EXPECT_NEAR(kind.gradient(corner(1e-6)).col(1).norm(), 0.5, 1e-9);  // but next to them it has
}

TEST(CornerAngle, RefusesStraightAndClosedCornersAndMissingLegsByName) {
  const auto refusal = [](const Points<3>& rest) {
    return complaint<std::invalid_argument>([&] { CornerAngle::at_rest(rest); });
  };
  Points<3> straight;
  straight << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(-2, 0, 0);
  EXPECT_EQ(refusal(straight), "corner angle: sine of the rest angle is 0");
  straight.col(2) *= -1;
  EXPECT_EQ(refusal(straight), "corner angle: sine of the rest angle is 0");
  EXPECT_EQ(refusal(corner(1, 0, 1)), "corner angle: length of leg p0 p1 is 0");
  EXPECT_EQ(refusal(corner(1, 1, 0)), "corner angle: length of leg p0 p2 is 0");
  EXPECT_EQ(refusal(corner(1, std::numeric_limits<Real>::infinity(), 1)), "corner angle: length of leg p0 p1 is inf");
}

}  // namespace
}  // namespace penalty::testing
