#include "penalty/math/affine_span.h"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "math/random.h"

namespace penalty::testing {
namespace {

PackedVectors turned(Eigen::Matrix3Xd points, Random& random) {
  const Vector3 shift = random.vector(10);
  points = (random.rotation() * points).colwise() + shift;
  return pack(points);
}

TEST(AffineSpan, CountsTheDimensionsOfPoints) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Eigen::Matrix3Xd points = random.vectors<Eigen::Dynamic>(30, 1);
    for (int dimension = 0; dimension <= 3; ++dimension) {
      Eigen::Matrix3Xd flat = points;
      flat.bottomRows(3 - dimension).setZero();
      EXPECT_EQ(affine_span(turned(flat, random), 1).dimension, dimension);
    }
  }
}

TEST(AffineSpan, MeasuresTheSpreadAlongThePrincipalAxes) {
  Eigen::Matrix3Xd points(3, 6);
  points << 3, -3, 0, 0, 0, 0,  //
      0, 0, 2, -2, 0, 0,        //
      0, 0, 0, 0, 1, -1;
  Random random(1);
  const AffineSpan span = affine_span(turned(points, random));
  EXPECT_EQ(span.dimension, 3);
  EXPECT_LT((span.spreads - Vector3(3, 2, 1) / std::sqrt(3.0)).norm(), 1e-13);
}

TEST(AffineSpan, TakesPointsThatAreNotFiniteForGeneral) {
  PackedVectors points = PackedVectors::Ones(4, 3);
  points(1, 2) = std::nan("");
  EXPECT_EQ(affine_span(points).dimension, 3);
  EXPECT_EQ(affine_span(1e200 * PackedVectors::Ones(4, 3)).dimension, 0);
  EXPECT_EQ(affine_span(1e200 * PackedVectors::Identity(4, 3)).dimension, 3);
  EXPECT_EQ(affine_span(PackedVectors(4, 0)).dimension, 0);
}

TEST(Jitter, IsTheSameEveryTimeSmallAndInNoPlane) {
  PackedVectors once = PackedVectors::Zero(4, 1000), again = once;
  std::vector<Real> inverse_masses(1000, 2);
  inverse_masses[7] = 0;
  jitter(once, inverse_masses, 0.25);
  jitter(again, inverse_masses, 0.25);
  EXPECT_EQ(once, again);
  EXPECT_LE(once.cwiseAbs().maxCoeff(), 0.25);
  EXPECT_TRUE(once.col(7).isZero(0)) << "pinned";
  EXPECT_TRUE(once.row(3).isZero(0)) << "padding";
  const AffineSpan span = affine_span(once);
  EXPECT_EQ(span.dimension, 3);
  // Uniform in [-1, 1) has a standard deviation of 1/sqrt(3); of a thousand the estimate is good to some 2 %.
  for (const Real spread : span.spreads) EXPECT_NEAR(spread, 0.25 / std::sqrt(3.0), 0.01);
  EXPECT_LT(once.topRows<3>().rowwise().mean().cwiseAbs().maxCoeff(), 0.02);
}

TEST(Unfold, LeadsOutOfEveryFlatStateWithoutTurningAnElementInsideOut) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const PackedVectors rest = pack(random.vectors<Eigen::Dynamic>(40, 1));
    const AffineSpan span = affine_span(rest);
    const std::vector<Real> inverse_masses(40, 1);
    for (const int dimension : {0, 1, 2}) {
      const Matrix3 rotation = random.rotation();
      const Vector3 kept(dimension > 0, dimension > 1, 0), shift = random.vector(5);
      PackedVectors x = pack((rotation * kept.asDiagonal() * rest.topRows<3>()).colwise() + shift);
      EXPECT_TRUE(unfold(x, rest, span, inverse_masses));
      EXPECT_EQ(affine_span(x, span.spreads[0]).dimension, 3);
      // The affine map from rest, by least squares: it keeps the orientation. The rotation that fits best is not quite
      // that of the flat state, unless the points spread evenly, so the volume is not exactly that of the two added up.
      const Eigen::Matrix3Xd from = rest.topRows<3>().colwise() - rest.topRows<3>().rowwise().mean();
      const Eigen::Matrix3Xd to = x.topRows<3>().colwise() - x.topRows<3>().rowwise().mean();
      const Matrix3 map = to * from.transpose() * (from * from.transpose()).inverse();
      const Real added_up = std::pow(1.1, dimension) * std::pow(0.1, 3 - dimension);
      EXPECT_NEAR(map.determinant(), added_up, 0.1 * added_up);
      EXPECT_FALSE(unfold(x, rest, span, inverse_masses)) << "once is enough";
    }
  }
}

TEST(Unfold, LeavesAloneWhatIsFlatAtRestAndWhatIsPinned) {
  Random random(1);
  Eigen::Matrix3Xd sheet = random.vectors<Eigen::Dynamic>(20, 1);
  sheet.row(2).setZero();
  PackedVectors x = pack(sheet);
  const PackedVectors before = x;
  std::vector<Real> inverse_masses(20, 1);
  EXPECT_FALSE(unfold(x, before, affine_span(before), inverse_masses));
  EXPECT_EQ(x, before);
  const PackedVectors rest = pack(random.vectors<Eigen::Dynamic>(20, 1));
  inverse_masses[4] = 0;
  EXPECT_TRUE(unfold(x, rest, affine_span(rest), inverse_masses));
  EXPECT_EQ(x.col(4), before.col(4));
}

}  // namespace
}  // namespace penalty::testing
