#include "penalty/math/triple.h"

#include "math/random.h"

namespace penalty::testing {
namespace {

Triple triple(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Vector3 vector3(Triple t) { return {t.x, t.y, t.z}; }

TEST(Triple, IsVector3) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Vector3 a = random.vector(1), b = random.vector(1);
    const Real s = random.uniform(-3, 3);
    EXPECT_EQ(vector3(triple(a) + triple(b)), a + b);
    EXPECT_EQ(vector3(triple(a) - triple(b)), a - b);
    EXPECT_EQ(vector3(-triple(a)), -a);
    EXPECT_EQ(vector3(triple(a) * s), a * s);
    EXPECT_NEAR(dot(triple(a), triple(b)), a.dot(b), 1e-15);
    EXPECT_LT((vector3(cross(triple(a), triple(b))) - a.cross(b)).norm(), 1e-15);
  }
}

TEST(Triple, ReadsAndWritesOneColumn) {
  Points<2> p;
  p << 1, 4, 2, 5, 3, 6;
  EXPECT_EQ(vector3(Triple::column(p, 1)), Vector3(4, 5, 6));
  Triple{7, 8, 9}.store(p, 0);
  EXPECT_EQ(p.col(0), Vector3(7, 8, 9));
  EXPECT_EQ(p.col(1), Vector3(4, 5, 6));
}

}  // namespace
}  // namespace penalty::testing
