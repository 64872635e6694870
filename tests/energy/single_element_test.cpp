// One element, by hand.
#include <numbers>

#include "kinds/samples.h"
#include "penalty/energy/penalty_energy.h"

namespace penalty::testing {
namespace {

TEST(Spring, ForceIsSeedEquation13) {
  // L0 = 2 m, K = 5 J, stretched to 3 m: C = 1/2, |F| = K C / L0 = 1.25 N, E = 0.625 J.
  Points<2> rest, points;
  rest << Vector3(0, 0, 0), Vector3(2, 0, 0);
  points << Vector3(1, 1, 1), Vector3(1, 1, 4);
  const Length spring = Length::at_rest(rest);
  const Gradient<2> f = force(spring, 5, points);
  EXPECT_DOUBLE_EQ(energy(spring, 5, points), 0.625);
  EXPECT_LT((f.col(1) - Vector3(0, 0, -1.25)).norm(), 1e-15);
  EXPECT_EQ(f.col(0), -f.col(1));
}

TEST(Spring, StiffnessAlongItIsKOverTheSquareOfItsRestLength) {
  Points<2> rest;
  rest << Vector3(0, 0, 0), Vector3(0, 0.5, 0);
  const Hessian<2> k = stiffness_matrix(Length::at_rest(rest), 3, rest, StiffnessModel::exact);
  Hessian<2> expected = Hessian<2>::Zero();
  expected(1, 1) = expected(4, 4) = 3 / 0.25;
  expected(1, 4) = expected(4, 1) = -3 / 0.25;
  EXPECT_LT(relative_error(k, expected), 1e-15);
}

TEST(Spring, UnderCompressionTheExactStiffnessIsNegativeAcrossIt) {
  // Eigenvalues of the blocks of d²E: K/L0² along, K (l - L0) / (L0² l) across.
  Points<2> rest, points;
  rest << Vector3(0, 0, 0), Vector3(2, 0, 0);
  points << Vector3(0, 0, 0), Vector3(0.5, 0, 0);
  const Hessian<2> k = stiffness_matrix(Length::at_rest(rest), 8, points, StiffnessModel::exact);
  EXPECT_DOUBLE_EQ(k(0, 0), 2);
  EXPECT_DOUBLE_EQ(k(1, 1), 8 * (0.5 - 2) / (4 * 0.5));
  EXPECT_DOUBLE_EQ(k(1, 4), -k(1, 1));
}

TEST(Spring, OfZeroLengthPushesApartWithTheFullForce) {
  Points<2> rest, points;
  rest << Vector3(0, 0, 0), Vector3(0, 0, 2);
  points.setConstant(7);
  const Gradient<2> f = force(Length::at_rest(rest), 5, points);  // C = -1: |F| = K / L0
  EXPECT_LT((f.col(1) - Vector3(0, 0, 2.5)).norm(), 1e-15);
  EXPECT_EQ(f.col(0), -f.col(1));
}

// Edge a, centre at the origin.
Points<4> regular_tetrahedron(Real edge) {
  Points<4> p;
  p << Vector3(1, 1, 1), Vector3(1, -1, -1), Vector3(-1, 1, -1), Vector3(-1, -1, 1);
  return p * (edge / std::sqrt(8.0));
}

TEST(RegularTetrahedron, InflatedPullsEveryPointInwards) {
  // Scaled by s: C = s³ - 1, |dC/dp| = (face area) / 3 V0 = s² √6 / 2a, so |F| = K (s³ - 1) s² √6 / 2a.
  const Real a = 0.3, k = 40;
  for (const bool other_orientation : {false, true})
    for (const Real s : {1.5, 1.01, 0.6}) {
      SCOPED_TRACE("scale " + std::to_string(s));
      Points<4> rest = regular_tetrahedron(a);
      if (other_orientation) rest.col(0).swap(rest.col(1));
      const TetrahedronVolume kind = TetrahedronVolume::at_rest(rest);
      EXPECT_NEAR(std::abs(kind.rest_volume()), a * a * a / (6 * std::numbers::sqrt2), 1e-15);
      const Gradient<4> f = force(kind, k, s * rest);
      const Real outward = -k * (s * s * s - 1) * s * s * std::sqrt(6.0) / (2 * a);
      for (int i = 0; i < 4; ++i)
        EXPECT_LT((f.col(i) - outward * rest.col(i).normalized()).norm(), 1e-12 * std::abs(outward));
    }
}

}  // namespace
}  // namespace penalty::testing
