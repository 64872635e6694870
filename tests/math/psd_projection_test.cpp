#include "penalty/math/psd_projection.h"

#include "math/eigenvalues.h"
#include "math/random.h"

namespace penalty::testing {
namespace {

template <int Size>
Eigen::Matrix<Real, Size, Size> random_symmetric(Random& random) {
  Eigen::Matrix<Real, Size, Size> a;
  for (Real& entry : a.reshaped()) entry = random.uniform(-1, 1);
  return a + a.transpose().eval();
}

// P is the nearest positive semidefinite matrix to A if and only if P >= 0, P - A >= 0 and <P, P - A> = 0: the
// optimality conditions of projection onto a convex cone that is its own dual.
template <int Size>
void expect_nearest() {
  WorstError error;
  int indefinite = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Random random(seed);
    const Eigen::Matrix<Real, Size, Size> a = random_symmetric<Size>(random);
    indefinite += smallest_eigenvalue(a) < -0.1;
    const Eigen::Matrix<Real, Size, Size> p = psd_projection<Size>(a), rest = p - a;
    error.see(-smallest_eigenvalue(p) / a.norm(), seed);
    error.see(-smallest_eigenvalue(rest) / a.norm(), seed);
    error.see(std::abs(p.cwiseProduct(rest).sum()) / a.squaredNorm(), seed);
    error.see((p - p.transpose()).norm() / a.norm(), seed);
  }
  EXPECT_GT(indefinite, 50);
  error.expect_below(1e-14, "size " + std::to_string(Size));
}

TEST(PsdProjection, IsTheNearestPositiveSemidefiniteMatrix) {
  expect_nearest<3>();
  expect_nearest<6>();
  expect_nearest<12>();
}

TEST(PsdProjection, DropsTheNegativeEigenvalue) {
  const Matrix3 r = Random(7).rotation();
  const Matrix3 a = r * Vector3(3, -4, 0.5).asDiagonal() * r.transpose();
  const Matrix3 expected = r * Vector3(3, 0, 0.5).asDiagonal() * r.transpose();
  EXPECT_LT(relative_error(psd_projection<3>(a), expected), 1e-15 * 10);
}

TEST(PsdProjection, LeavesAPositiveSemidefiniteMatrixAlone) {
  Matrix3 a;
  a << 2, 1, 0, 1, 2, 0, 0, 0, 5;
  EXPECT_EQ(psd_projection<3>(a), a);
  EXPECT_EQ(psd_projection<3>(Matrix3::Zero()), Matrix3::Zero());
}

TEST(PsdProjection, OfANegativeMatrixIsZero) { EXPECT_EQ(psd_projection<3>(-Matrix3::Identity()), Matrix3::Zero()); }

}  // namespace
}  // namespace penalty::testing
