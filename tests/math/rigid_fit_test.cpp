#include "penalty/math/rigid_fit.h"

#include <cmath>
#include <limits>

#include "math/eigenvalues.h"
#include "math/random.h"

namespace penalty::testing {
namespace {

TEST(BestRotation, IsARotationThatNoOtherBeats) {
  WorstError orthogonality, loss;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Random random(seed);
    Matrix3 a = random.vectors<3>(3, 1);
    if (seed % 4 == 1) a.col(2) = a.col(0) - 2 * a.col(1);  // rank two
    if (seed % 4 == 2) a = a.col(0) * a.row(1);             // rank one
    if (seed % 4 == 3) a = -random.rotation();              // a mirror image, without any preference
    const Matrix3 r = best_rotation(a);
    orthogonality.see((r.transpose() * r - Matrix3::Identity()).norm() + std::abs(r.determinant() - 1), seed);
    const Real best = (r.transpose() * a).trace();
    const Vector3 s = singular_values(a);
    loss.see(s[0] + s[1] + std::copysign(s[2], a.determinant()) - best, seed);
    for (int k = 0; k < 200; ++k)
      EXPECT_LE(((random.rotation() * (k % 2 == 0 ? Matrix3::Identity() : r)).transpose() * a).trace(), best + 1e-14);
    for (int k = 0; k < 30; ++k) {  // near it too
      const Matrix3 turned = Eigen::AngleAxis<Real>(random.uniform(-1e-3, 1e-3), random.direction()) * r;
      EXPECT_LE((turned.transpose() * a).trace(), best + 1e-14) << "seed " << seed;
    }
  }
  orthogonality.expect_below(1e-14, "orthogonality");
  loss.expect_below(1e-14, "distance to the maximum");
}

TEST(BestRotation, IsThePolarFactorOfWhatWasTurnedAndStretched) {
  WorstError error;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Random random(seed);
    const Matrix3 r = random.rotation(), axes = random.rotation();
    Vector3 s(1, random.uniform(0.05, 1), 0);
    s[2] = s[1] * random.uniform(-0.9, 1);  // inverted too: s2 + s3 > 0
    const Real size = std::pow(10.0, random.uniform(-9, 9));
    const Matrix3 a = size * r * axes * s.asDiagonal() * axes.transpose();
    error.see((best_rotation(a) - r).norm() * (s[1] + s[2]), seed);  // over its condition number
  }
  error.expect_below(1e-14, "distance to the known rotation");
}

TEST(BestRotation, IsFiniteAndTheSameEveryTimeWhereItIsNotUnique) {
  EXPECT_EQ(best_rotation(Matrix3::Zero()), Matrix3::Identity());
  for (const Matrix3& a : {Matrix3(-Matrix3::Identity()), Matrix3(Vector3(1, 2, 3) * Vector3(1, 0, 1).transpose()),
                           Matrix3(Vector3(-1, -1, 0).asDiagonal()), Matrix3(Matrix3::Constant(1e-200)),
                           Matrix3(Matrix3::Constant(1e200))}) {
    const Matrix3 r = best_rotation(a);
    EXPECT_EQ(r, best_rotation(a));
    EXPECT_LT((r.transpose() * r - Matrix3::Identity()).norm(), 1e-14);
    EXPECT_NEAR(r.determinant(), 1, 1e-14);
  }
  EXPECT_TRUE(best_rotation(Matrix3::Constant(std::numeric_limits<Real>::quiet_NaN())).allFinite());
}

}  // namespace
}  // namespace penalty::testing
