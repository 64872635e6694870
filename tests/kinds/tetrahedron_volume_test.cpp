#include "penalty/kinds/tetrahedron_volume.h"

#include "kinds/samples.h"
#include "penalty/energy/penalty_energy.h"

namespace penalty::testing {
namespace {

// Two orthonormal legs and a third: V = 1/6 if the last is +z.
Points<4> unit_tetrahedron(const Vector3& p3 = {0, 0, 1}) {
  Points<4> p;
  p << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), p3;
  return p;
}

// Seed eq. 14 and 20 as printed, for p_i, with the names (i, j, k, l) filled by `order`. V is taken with the same
// names.
Vector3 seed_force(Real stiffness, Real rest_volume, const Points<4>& p, const std::array<int, 4>& order) {
  const Vector3 pi = p.col(order[0]), pj = p.col(order[1]), pk = p.col(order[2]), pl = p.col(order[3]);
  const Real volume = (pj - pi).dot((pk - pi).cross(pl - pi)) / 6;
  const Real c = (volume - rest_volume) / rest_volume;
  return stiffness * c / (6 * rest_volume) * (pj - pl).cross(pk - pl);
}

constexpr std::array<std::array<int, 4>, 4> even_permutations{{{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}};

TEST(TetrahedronVolume, OfAnOrthogonalCornerIsASixth) {
  EXPECT_DOUBLE_EQ(TetrahedronVolume::signed_volume(unit_tetrahedron()), 1.0 / 6);
  EXPECT_DOUBLE_EQ(TetrahedronVolume::signed_volume(unit_tetrahedron({0, 0, -1})), -1.0 / 6);
  const TetrahedronVolume kind = TetrahedronVolume::at_rest(unit_tetrahedron());
  EXPECT_DOUBLE_EQ(kind.rest_volume(), 1.0 / 6);
  EXPECT_DOUBLE_EQ(kind.value(unit_tetrahedron({5, -7, 3})), 2);   // only the height counts
  EXPECT_DOUBLE_EQ(kind.value(unit_tetrahedron({0, 0, -1})), -2);  // inverted
}

TEST(TetrahedronVolume, GradientOfAPointIsAlongTheNormalOfTheOppositeFace) {
  // V = z3 / 6 for these points, so dC/dp3 = (0, 0, 1) with V0 = 1/6, and dC/dp0 = -(1, 1, 1) by symmetry.
  const Gradient<4> gradient = TetrahedronVolume::at_rest(unit_tetrahedron()).gradient(unit_tetrahedron());
  EXPECT_LT((gradient.col(3) - Vector3(0, 0, 1)).norm(), 1e-15);
  EXPECT_LT((gradient.col(0) + Vector3(1, 1, 1)).norm(), 1e-15);
}

TEST(TetrahedronVolume, SeedEquation20UnderEvenPermutationsGivesAllFourForces) {
  WorstError error;
  int negative_rest_volumes = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TetrahedronVolume>(seed);
    SCOPED_TRACE(trace(s));
    negative_rest_volumes += s.kind.rest_volume() < 0;
    const Gradient<4> ours = force(s.kind, 3.5, s.points);
    ASSERT_GT(ours.norm(), 0);
    for (int k = 0; k < 4; ++k)
      error.see(
          (seed_force(3.5, s.kind.rest_volume(), s.points, even_permutations[k]) - ours.col(k)).norm() / ours.norm(),
          seed);
  }
  EXPECT_GT(negative_rest_volumes, 100);
  error.expect_below(1e-12, "seed forces");
}

TEST(TetrahedronVolume, SeedEquation20UnderTheCyclicShiftTurnsTheVolumeAndIsWrongEvenAtRest) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto s = sample<TetrahedronVolume>(seed);
    SCOPED_TRACE(trace(s));
    const Gradient<4> gradient = s.kind.gradient(s.rest);
    EXPECT_LT(force(s.kind, 1, s.rest).norm(), 1e-13 * gradient.norm());  // ours: no force at rest
    Points<4> shifted;
    shifted << s.rest.col(1), s.rest.col(2), s.rest.col(3), s.rest.col(0);
    EXPECT_NEAR(TetrahedronVolume::signed_volume(shifted) * s.kind.inverse_rest_volume, -1, 1e-13);
    // C = -2, so the "force" on p_j at rest is -2 K dC/dp_j.
    const Vector3 wrong = seed_force(1, s.kind.rest_volume(), s.rest, {1, 2, 3, 0});
    EXPECT_GT(wrong.norm(), 0.1 * gradient.norm());
    EXPECT_LT((wrong + 2 * gradient.col(1)).norm(), 1e-12 * gradient.norm());
    // Two shifts are even again.
    EXPECT_LT(seed_force(1, s.kind.rest_volume(), s.rest, {2, 3, 0, 1}).norm(), 1e-13 * gradient.norm());
  }
}

TEST(TetrahedronVolume, AnInvertedTetrahedronIsPulledBackThroughFlat) {
  const TetrahedronVolume kind = TetrahedronVolume::at_rest(unit_tetrahedron());
  for (const Real height : {-1.0, -0.1, 0.0, 0.1, 0.9}) {
    SCOPED_TRACE("height " + std::to_string(height));
    EXPECT_GT(force(kind, 1, unit_tetrahedron({0, 0, height}))(2, 3), 0);
  }
}

TEST(TetrahedronVolume, ANegativeRestVolumeIsAsGoodAsAPositiveOne) {
  const TetrahedronVolume kind = TetrahedronVolume::at_rest(unit_tetrahedron({0, 0, -1}));
  EXPECT_DOUBLE_EQ(kind.rest_volume(), -1.0 / 6);
  EXPECT_EQ(kind.value(unit_tetrahedron({0, 0, -1})), 0);
  EXPECT_DOUBLE_EQ(kind.value(unit_tetrahedron({0, 0, -2})), 1);
  // The mirror image of the force on the positive one.
  const Gradient<4> force_below = force(kind, 1, unit_tetrahedron({0, 0, -2}));
  Gradient<4> mirrored = force(TetrahedronVolume::at_rest(unit_tetrahedron()), 1, unit_tetrahedron({0, 0, 2}));
  mirrored.row(2) *= -1;
  ASSERT_GT(mirrored.norm(), 1);
  EXPECT_LT(relative_error(force_below, mirrored), 1e-15);
}

TEST(TetrahedronVolume, OnlyCollinearPointsHaveNoGradient) {
  const TetrahedronVolume kind = TetrahedronVolume::at_rest(unit_tetrahedron());
  Points<4> line;
  for (int k = 0; k < 4; ++k) line.col(k) = k * Vector3(1, 2, -1);
  EXPECT_TRUE(kind.gradient(line).isZero(1e-15));
  EXPECT_GT(kind.gradient(unit_tetrahedron({0.3, 0.3, 0})).norm(), 1);
}

TEST(TetrahedronVolume, RefusesFlatRestShapesByName) {
  EXPECT_EQ(complaint<std::invalid_argument>([] { TetrahedronVolume::at_rest(unit_tetrahedron({1, 1, 0})); }),
            "tetrahedron volume: rest volume is 0");
}

}  // namespace
}  // namespace penalty::testing
