#include "penalty/kinds/tetrahedron_dihedral_angle.h"

#include <array>
#include <numbers>

#include "kinds/samples.h"

namespace penalty::testing {
namespace {

using std::numbers::pi;

// The edge along x, p2 above y, p3 turned from it by `angle` about x: positive volume for positive angles.
Points<4> wedge(Real angle) {
  Points<4> p;
  p << Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(0.5, 1.5, 0), Vector3(1.3, std::cos(angle), std::sin(angle));
  return p;
}

Points<4> regular_tetrahedron() {
  Points<4> p;
  p << Vector3(1, 1, 1), Vector3(-1, 1, -1), Vector3(1, -1, -1), Vector3(-1, -1, 1);
  return p;
}

// The six edges, each with the other two points in the order that keeps the orientation.
constexpr std::array<std::array<int, 4>, 6> edges{
    {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}}};

Points<4> seen_from(const Points<4>& p, const std::array<int, 4>& order) {
  Points<4> result;
  for (int k = 0; k < 4; ++k) result.col(k) = p.col(order[k]);
  return result;
}

TEST(TetrahedronDihedralAngle, OfTheRegularTetrahedronIsTheArcCosineOfAThird) {
  Points<4> p = regular_tetrahedron();
  ASSERT_GT(TetrahedronVolume::signed_volume(p), 0);
  for (const auto& edge : edges)
    EXPECT_NEAR(TetrahedronDihedralAngle::angle(seen_from(p, edge)), std::acos(1.0 / 3), 1e-15);
  p.col(2).swap(p.col(3));
  for (const auto& edge : edges)
    EXPECT_NEAR(TetrahedronDihedralAngle::angle(seen_from(p, edge)), -std::acos(1.0 / 3), 1e-15);
}

TEST(TetrahedronDihedralAngle, OfAnOrthogonalCornerIsARightAngle) {
  Points<4> p;
  p << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1);
  for (const int k : {0, 1, 2}) EXPECT_DOUBLE_EQ(TetrahedronDihedralAngle::angle(seen_from(p, edges[k])), pi / 2);
  for (const int k : {3, 4, 5})
    EXPECT_DOUBLE_EQ(TetrahedronDihedralAngle::angle(seen_from(p, edges[k])), std::acos(1 / std::sqrt(3.0)));
}

TEST(TetrahedronDihedralAngle, HasTheSignOfTheVolume) {
  int negative = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const Points<4> p = sample<TetrahedronDihedralAngle>(seed).points;
    const Real volume = TetrahedronVolume::signed_volume(p);
    EXPECT_GT(volume * TetrahedronDihedralAngle::angle(p), 0) << "seed " << seed;
    negative += volume < 0;
  }
  EXPECT_GT(negative, 100);
  EXPECT_LT(negative, static_cast<int>(num_samples) - 100);
}

TEST(TetrahedronDihedralAngle, IsTheBendingAngleAndHalfATurn) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const Points<4> p = sample<TetrahedronDihedralAngle>(seed).points;
    const Real beta = TetrahedronDihedralAngle::angle(p), theta = BendingAngle::angle(p);
    error.see(std::abs(std::abs(beta - theta) - pi), seed);
  }
  error.expect_below(1e-15, "difference from half a turn");
}

TEST(TetrahedronDihedralAngle, ThreeFacesProjectedOnTheFourthCoverIt) {
  // A_0 = sum of A_i cos beta_i over the other faces, beta_i at the edge that they share with face 0 = p1 p2 p3.
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const Points<4> p = sample<TetrahedronDihedralAngle>(seed).points;
    const auto area = [&](int i, int j, int k) { return (p.col(j) - p.col(i)).cross(p.col(k) - p.col(i)).norm() / 2; };
    const auto cosine = [&](int edge) { return std::cos(TetrahedronDihedralAngle::angle(seen_from(p, edges[edge]))); };
    const Real covered = area(0, 1, 2) * cosine(3) + area(0, 1, 3) * cosine(4) + area(0, 2, 3) * cosine(5);
    error.see(std::abs(covered / area(1, 2, 3) - 1), seed);
  }
  error.expect_below(1e-11, "relative error of the area");
}

TEST(TetrahedronDihedralAngle, IsTheTurnBetweenTheFaces) {
  const TetrahedronDihedralAngle kind = TetrahedronDihedralAngle::at_rest(wedge(1));
  EXPECT_NEAR(kind.rest_angle, 1, 1e-15);
  for (const Real angle : {-2.1, -0.5, 0.0, 0.3, 2.0, 3.1}) EXPECT_NEAR(kind.value(wedge(angle)), angle - 1, 1e-14);
}

TEST(TetrahedronDihedralAngle, IsTakenTheShortWayRound) {
  const TetrahedronDihedralAngle kind = TetrahedronDihedralAngle::at_rest(wedge(2.5));
  EXPECT_NEAR(kind.value(wedge(-2.5)), 2 * pi - 5, 1e-14);  // inverted: back through pi
  EXPECT_NEAR(kind.value(wedge(-0.5)), -3, 1e-14);          // back through 0
  EXPECT_NEAR(kind.value(wedge(-0.7)), 2 * pi - 3.2, 1e-14);
}

TEST(TetrahedronDihedralAngle, AnInvertedTetrahedronIsOpenedThroughFlat) {
  // The mirror image of the regular one: the gradient of p3 leads to larger angles, up through z = 0.
  const TetrahedronDihedralAngle kind = TetrahedronDihedralAngle::at_rest(wedge(1.2));
  for (const Real angle : {-1.2, -0.6, -0.01, 0.01, 0.6}) {
    EXPECT_LT(kind.value(wedge(angle)), 0);
    const Vector3 towards(0, -std::sin(angle), std::cos(angle));
    EXPECT_LT((kind.gradient(wedge(angle)).col(3) - towards).norm(), 1e-14);
  }
}

TEST(TetrahedronDihedralAngle, RefusesFacesWithoutAnAreaByName) {
  Points<4> p = wedge(1);
  p.col(3) = p.col(1) / 4;
  EXPECT_EQ(complaint<std::invalid_argument>([&] { TetrahedronDihedralAngle::at_rest(p); }),
            "tetrahedron dihedral angle: area of triangle p0 p1 p3 is 0");
}

}  // namespace
}  // namespace penalty::testing
