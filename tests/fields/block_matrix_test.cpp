#include "penalty/fields/block_matrix.h"

#include "fields/meshes.h"

namespace penalty::testing {
namespace {

Matrix3 random_block(Random& random) { return random.vectors<3>(3, 1); }

TEST(BlockMatrix, KeepsThePatternOnceAndAlwaysTheDiagonal) {
  const BlockMatrix a(4, {{2, 1}, {1, 2}, {2, 1}, {3, 3}});
  EXPECT_EQ(a.num_particles(), 4);
  EXPECT_EQ(a.num_blocks(), 6u);
  EXPECT_TRUE(a.to_dense().isZero(0));
}

TEST(BlockMatrix, BlocksAddUpAndAreZeroOutsideThePattern) {
  Random random(1);
  BlockMatrix a(3, {{0, 2}, {2, 0}});
  const Matrix3 b = random_block(random), c = random_block(random), d = random_block(random);
  a.add_block(0, 2, b);
  a.add_block(0, 2, c);
  a.add_block(1, 1, d);
  EXPECT_EQ(a.block(0, 2), b + c);
  EXPECT_EQ(a.block(1, 1), d);
  EXPECT_EQ(a.block(2, 0), Matrix3::Zero());  // no symmetry behind the caller's back
  EXPECT_EQ(a.block(0, 1), Matrix3::Zero());
  a.set_zero();
  EXPECT_TRUE(a.to_dense().isZero(0));
  EXPECT_EQ(a.num_blocks(), 5u);
}

TEST(BlockMatrix, ProductIsThatOfTheDenseMatrix) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const int particles = 7;
    std::vector<std::pair<int, int>> pattern;
    pattern.reserve(15);
    for (int k = 0; k < 15; ++k)
      pattern.emplace_back(static_cast<int>(random.index(particles)), static_cast<int>(random.index(particles)));
    BlockMatrix a(particles, pattern);
    for (auto [row, column] : pattern) a.add_block(row, column, random_block(random));
    const PackedVectors x = random_packed(particles, 1, random), start = random_packed(particles, 1, random);
    PackedVectors y = start;
    a.add_product(x, -2.5, y);
    const Eigen::VectorXd expected = start.topRows<3>().reshaped() - 2.5 * (a.to_dense() * x.topRows<3>().reshaped());
    ASSERT_GT((y - start).norm(), 0);
    EXPECT_LT(relative_error(y.topRows<3>().reshaped(), expected), 1e-14);
    EXPECT_TRUE(y.row(3).isZero(0));
  }
}

TEST(BlockMatrix, RefusesAPatternOutsideTheParticles) {
  EXPECT_EQ(complaint<std::out_of_range>([] { BlockMatrix(3, {{0, 1}, {2, 3}}); }),
            "block matrix: block (2, 3) of 3 particles");
  EXPECT_EQ(complaint<std::out_of_range>([] { BlockMatrix(3, {{-1, 0}}); }),
            "block matrix: block (-1, 0) of 3 particles");
}

TEST(BlockMatrix, MayBeEmpty) {
  const BlockMatrix a(0, {});
  EXPECT_EQ(a.num_particles(), 0);
  EXPECT_EQ(a.to_dense().size(), 0);
}

}  // namespace
}  // namespace penalty::testing
