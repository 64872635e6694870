#include "scenes/start_shapes.h"

#include <gtest/gtest.h>

#include "penalty/mesh/builders.h"

namespace penalty::demo {
namespace {

const Eigen::Matrix3Xd& rest() {
  static const Eigen::Matrix3Xd vertices = make_torus().vertices;
  return vertices;
}

Vector3 extent(const Eigen::Matrix3Xd& x) { return x.rowwise().maxCoeff() - x.rowwise().minCoeff(); }

TEST(StartShapes, LoseWhatTheirNamesSay) {
  const Vector3 full = extent(rest());
  ASSERT_GT(full.minCoeff(), 0.5);
  EXPECT_EQ(start_positions(rest(), Start::rest, 1), rest());
  EXPECT_NEAR(extent(start_positions(rest(), Start::squash, 1)).y(), 0.2 * full.y(), 1e-12);
  EXPECT_EQ(extent(start_positions(rest(), Start::plane, 1)).y(), 0);
  EXPECT_GT(extent(start_positions(rest(), Start::plane, 1)).x(), 1);
  EXPECT_EQ(extent(start_positions(rest(), Start::line, 1)).tail<2>().norm(), 0);
  EXPECT_GT(extent(start_positions(rest(), Start::line, 1)).x(), 1);
  EXPECT_EQ(extent(start_positions(rest(), Start::point, 1)).norm(), 0);
}

TEST(StartShapes, MirrorTurnsEveryTetrahedronInsideOut) {
  const TetMesh torus = make_torus();
  for (Real volume : signed_volumes(start_positions(rest(), Start::mirror, 1), torus.tetrahedra)) ASSERT_LT(volume, 0);
}

TEST(StartShapes, ScrambleFillsTheBoxAndFollowsTheSeed) {
  const Eigen::Matrix3Xd scrambled = start_positions(rest(), Start::scramble, 4);
  EXPECT_EQ(scrambled, start_positions(rest(), Start::scramble, 4));
  EXPECT_NE(scrambled, start_positions(rest(), Start::scramble, 5));
  EXPECT_TRUE((scrambled.rowwise().minCoeff().array() >= rest().rowwise().minCoeff().array()).all());
  EXPECT_TRUE((extent(scrambled).array() > 0.95 * extent(rest()).array()).all());
  EXPECT_GT((scrambled - rest()).colwise().norm().mean(), 0.3);
}

TEST(StartShapes, JitterMovesEveryVertexALittle) {
  const Eigen::Matrix3Xd moved = start_positions(rest(), Start::jitter, 4);
  EXPECT_EQ(moved, start_positions(rest(), Start::jitter, 4));
  EXPECT_NE(moved, start_positions(rest(), Start::jitter, 5));
  const Real spacing = extent(rest()).norm() / std::cbrt(static_cast<Real>(rest().cols()));
  EXPECT_LE((moved - rest()).cwiseAbs().maxCoeff(), spacing / 2);
  EXPECT_GT((moved - rest()).cwiseAbs().minCoeff(), 0);
  EXPECT_NEAR((moved - rest()).cwiseAbs().mean(), spacing / 4, spacing / 40);
}

TEST(StartShapes, NamesGoThereAndBack) {
  for (const char* name : {"rest", "squash", "plane", "line", "point", "mirror", "scramble", "jitter"})
    EXPECT_EQ(name_of(start_from_name(name)), name);
  EXPECT_EQ(all_starts().size(), 8u);
  EXPECT_THROW(start_from_name("Rest"), std::invalid_argument);
  EXPECT_THROW(world_from_name(""), std::invalid_argument);
}

}  // namespace
}  // namespace penalty::demo
