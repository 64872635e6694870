#include "penalty/kinds/bending_angle.h"

#include <numbers>

#include "kinds/samples.h"
#include "math/eigenvalues.h"

namespace penalty::testing {
namespace {

using std::numbers::pi;

// The edge along x, the wing p2 in the plane z = 0 on the side of y, the other turned by `angle` out of it; both
// normals are z where it is flat.
Points<4> hinge(Real angle, Real height_a = 1, Real height_b = 1) {
  Points<4> p;
  p << Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(0.5, height_a, 0),
      Vector3(1.3, -height_b * std::cos(angle), -height_b * std::sin(angle));
  return p;
}

const BendingAngle flat = BendingAngle::at_rest(hinge(0));

TEST(BendingAngle, IsZeroWhereFlatAndTheTurnOfAWingElsewhere) {
  EXPECT_EQ(flat.rest_angle, 0);
  for (const Real angle : {-3.1, -pi / 2, -0.01, 0.0, 1e-6, 0.7, pi / 2, 3.1}) {
    EXPECT_NEAR(BendingAngle::angle(hinge(angle)), angle, 1e-15 * (1 + std::abs(angle)));
    EXPECT_NEAR(flat.value(hinge(angle, 0.1, 30)), angle, 1e-14);  // the sizes of the wings do not count
  }
}

TEST(BendingAngle, IsPositiveWhereTheTipsBendAwayFromTheNormals) {
  const Points<4> ridge = hinge(0.5);
  EXPECT_LT(ridge(2, 3), 0);  // the normals point along z
  EXPECT_GT(BendingAngle::angle(ridge), 0);
  EXPECT_LT(TetrahedronVolume::signed_volume(ridge), 0);
}

TEST(BendingAngle, ExchangingTheEndsOrTheTipsTurnsTheSign) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const Points<4> p = sample<BendingAngle>(seed).points;
    const Real angle = BendingAngle::angle(p);
    Points<4> ends = p, tips = p;
    ends.col(0).swap(ends.col(1));
    tips.col(2).swap(tips.col(3));
    Points<4> both = ends;
    both.col(2).swap(both.col(3));
    error.see(std::abs(BendingAngle::angle(ends) + angle), seed);
    error.see(std::abs(BendingAngle::angle(tips) + angle), seed);
    error.see(std::abs(BendingAngle::angle(both) - angle), seed);
  }
  error.expect_below(1e-12, "angle");
}

TEST(BendingAngle, AFullFoldIsPlusHalfATurn) {
  // Exactly folded: the sine is a zero of either sign.
  Points<4> p;
  for (const Real end : {2.0, -2.0}) {
    p << Vector3(0, 0, 0), Vector3(end, 0, 0), Vector3(1, 1, 0), Vector3(1, 2, 0);
    EXPECT_EQ(BendingAngle::angle(p), pi);
  }
}

TEST(BendingAngle, IsTakenTheShortWayRound) {
  const BendingAngle kind = BendingAngle::at_rest(hinge(3));
  EXPECT_NEAR(kind.value(hinge(-3)), 2 * pi - 6, 1e-14);  // 0.283 further on, not 6 back
  EXPECT_NEAR(kind.value(hinge(3.1)), 0.1, 1e-14);
  EXPECT_NEAR(kind.value(hinge(3 - pi + 0.01)), 0.01 - pi, 1e-14);
  EXPECT_NEAR(kind.value(hinge(3 - pi - 0.01)), pi - 0.01, 1e-14);
  for (Real angle = -3.1; angle < 3.1; angle += 0.1) {
    EXPECT_LE(kind.value(hinge(angle)), pi);
    EXPECT_GT(kind.value(hinge(angle)), -pi);
  }
}

TEST(BendingAngle, CrossesTheFullFoldSmoothly) {
  // Value and gradient on either side of theta = pi belong to one function.
  const BendingAngle kind = BendingAngle::at_rest(hinge(3));
  const Points<4> before = hinge(pi - 1e-7), after = hinge(-pi + 1e-7);
  EXPECT_NEAR(kind.value(after) - kind.value(before), 2e-7, 1e-14);
  EXPECT_LT(relative_error(kind.gradient(after), kind.gradient(before)), 1e-6);
}

TEST(BendingAngle, GradientOfATipIsOneOverItsHeightAlongTheNormal) {
  // Flat, normals along z: lowering either tip makes the angle larger. The ends carry the reactions: p2 stands at 1/4
  // of the edge, p3 at 0.65.
  const Gradient<4> gradient = flat.gradient(hinge(0, 0.5, 4));
  EXPECT_LT((gradient.col(2) - Vector3(0, 0, -2)).norm(), 1e-15);
  EXPECT_LT((gradient.col(3) - Vector3(0, 0, -0.25)).norm(), 1e-15);
  EXPECT_LT((gradient.col(0) - Vector3(0, 0, 0.75 * 2 + 0.35 * 0.25)).norm(), 1e-15);
  EXPECT_LT((gradient.col(1) - Vector3(0, 0, 0.25 * 2 + 0.65 * 0.25)).norm(), 1e-15);
}

TEST(BendingAngle, HessianOfATipHasTheEigenvaluesOfTheClosedForm) {
  // (n mᵀ + m nᵀ) / h²: +-1/h² in the plane across the edge, 0 along it. The tips are not coupled.
  const Real height = 0.4;
  const Hessian<4> hessian = flat.hessian(hinge(0.8, height, 3));
  const Vector3 eigenvalues = symmetric_eigenvalues(hessian.block<3, 3>(6, 6));
  EXPECT_LT((eigenvalues - Vector3(-1, 0, 1) / (height * height)).norm(), 1e-13);
  EXPECT_TRUE((hessian.block<3, 3>(6, 9).isZero(0)));
}

TEST(BendingAngle, AWingWithoutAnAreaHasNoGradient) {
  for (const Points<4>& p : {hinge(0.3, 0), hinge(0.3, 1, 0), hinge(0.3, 0, 0), hinge(0.3, 1e-8)}) {
    EXPECT_TRUE(std::isfinite(flat.value(p)));
    EXPECT_TRUE(flat.gradient(p).isZero(0)) << p;
    EXPECT_TRUE(flat.hessian(p).isZero(0)) << p;
  }
  Points<4> no_edge = hinge(0.3);
  no_edge.col(1) = no_edge.col(0);
  EXPECT_TRUE(flat.gradient(no_edge).isZero(0));
  EXPECT_NEAR(flat.gradient(hinge(0.3, 1e-6)).col(2).norm(), 1e6, 1e-3);  // a thin one has
}

TEST(BendingAngle, RefusesWingsWithoutAnAreaByName) {
  EXPECT_EQ(complaint<std::invalid_argument>([] { BendingAngle::at_rest(hinge(0.3, 0)); }),
            "bending angle: area of triangle p0 p1 p2 is 0");
  EXPECT_EQ(complaint<std::invalid_argument>([] { BendingAngle::at_rest(hinge(0, 1, 0)); }),
            "bending angle: area of triangle p0 p1 p3 is 0");
}

}  // namespace
}  // namespace penalty::testing
