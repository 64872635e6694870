#include "penalty/math/types.h"

#include "math/random.h"

namespace penalty::testing {
namespace {

TEST(Pack, PadsEveryParticleWithAZero) {
  const Eigen::Matrix3Xd vectors = Random(1).vectors<Eigen::Dynamic>(5, 2);
  const PackedVectors packed = pack(vectors);
  ASSERT_EQ(packed.cols(), 5);
  EXPECT_EQ(packed.topRows<3>(), vectors);
  EXPECT_TRUE(packed.row(3).isZero(0));
}

TEST(CrossMatrix, IsTheCrossProduct) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Vector3 a = random.vector(1), b = random.vector(1);
    EXPECT_LT((cross_matrix(a) * b - a.cross(b)).norm(), 1e-15);
    EXPECT_EQ(cross_matrix(a).transpose(), -cross_matrix(a));
  }
}

}  // namespace
}  // namespace penalty::testing
