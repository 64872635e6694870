#include "scenes/shape_measure.h"

#include <gtest/gtest.h>

#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::demo {
namespace {

struct Shape {
  TetMesh mesh = make_box({1, 2, 3}, {2, 3, 4});
  ShapeMeasure measure{mesh.vertices, mesh.tetrahedra};
};

TEST(ShapeMeasure, ARigidMotionIsNoError) {
  const Shape shape;
  const Matrix3 rotation = Eigen::AngleAxisd(2.1, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  const PackedVectors moved = pack((rotation * shape.mesh.vertices).colwise() + Vector3(5, -3, 7));
  EXPECT_LT(shape.measure.rest_error(moved), 1e-14);
  EXPECT_LT(shape.measure.errors(moved).length_max, 1e-13);
  EXPECT_LT(shape.measure.errors(moved).volume_max, 1e-12);
  EXPECT_EQ(shape.measure.errors(moved).inverted, 0);
}

TEST(ShapeErrors, OfTwoBodiesAreThoseOfBothAsOne) {
  const TetMesh small = make_box({1, 1, 1}, {1, 1, 1}), large = make_box({1, 2, 3}, {2, 3, 4});
  TetMesh both = large;
  const auto first = static_cast<int>(large.vertices.cols());
  both.vertices.conservativeResize(3, first + small.vertices.cols());
  both.vertices.rightCols(small.vertices.cols()) = small.vertices;
  for (const auto& [a, b, c, d] : small.tetrahedra)
    both.tetrahedra.push_back({a + first, b + first, c + first, d + first});
  Eigen::Matrix3Xd moved = both.vertices;
  moved.leftCols(first) *= 1.1;
  moved.rightCols(small.vertices.cols()).row(0) *= -1.3;  // inside-out

  ShapeErrors sum;
  sum += ShapeMeasure(large.vertices, large.tetrahedra).errors(pack(moved.leftCols(first)));
  sum += ShapeMeasure(small.vertices, small.tetrahedra).errors(pack(moved.rightCols(small.vertices.cols())));
  const ShapeErrors errors = ShapeMeasure(both.vertices, both.tetrahedra).errors(pack(moved));
  EXPECT_NEAR(sum.length_mean, errors.length_mean, 1e-14);
  EXPECT_NEAR(sum.volume_mean, errors.volume_mean, 1e-14);
  EXPECT_EQ(sum.length_max, errors.length_max);
  EXPECT_EQ(sum.volume_max, errors.volume_max);
  EXPECT_EQ(sum.inverted, 5);
  sum += ShapeMeasure(large.vertices, edges_of(large.tetrahedra)).errors(pack(large.vertices));  // has no volumes
  EXPECT_NEAR(sum.volume_mean, errors.volume_mean, 1e-14);
  EXPECT_LT(sum.length_mean, errors.length_mean);
}

TEST(ShapeMeasure, AScaledShapeErrsAsItsFactorsSay) {
  const Shape shape;
  const ShapeErrors errors = shape.measure.errors(pack(1.1 * shape.mesh.vertices));
  EXPECT_NEAR(errors.length_mean, 0.1, 1e-13);
  EXPECT_NEAR(errors.volume_max, 1.1 * 1.1 * 1.1 - 1, 1e-12);
  // Corners are the farthest from the middle: half the diagonal, of which a tenth is gained.
  EXPECT_NEAR(shape.measure.rest_error(pack(1.1 * shape.mesh.vertices)), 0.05, 1e-13);
}

TEST(ShapeMeasure, AReflectionIsNoRotation) {
  const Shape shape;
  const PackedVectors mirrored = pack(Vector3(-1, 1, 1).asDiagonal() * shape.mesh.vertices);
  EXPECT_GT(shape.measure.rest_error(mirrored), 0.1);
  EXPECT_EQ(shape.measure.errors(mirrored).inverted, static_cast<int>(shape.mesh.tetrahedra.size()));
  EXPECT_LT(shape.measure.errors(mirrored).length_max, 1e-13);
}

TEST(ShapeMeasure, ShowsNotANumber) {
  const Shape shape;
  PackedVectors broken = pack(shape.mesh.vertices);
  broken(1, 5) = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_TRUE(std::isnan(shape.measure.rest_error(broken)));
  EXPECT_TRUE(std::isnan(shape.measure.errors(broken).volume_mean));
  EXPECT_GT(shape.measure.errors(broken).inverted, 0);
}

TEST(ShapeMeasure, ASheetHasLengthsButNoVolumes) {
  const TriangleSurface sheet = make_sheet(2, 1, 4, 2);
  const ShapeMeasure measure(sheet.vertices, edges_of(sheet.triangles));
  const ShapeErrors errors = measure.errors(pack(1.1 * sheet.vertices));
  EXPECT_NEAR(errors.length_mean, 0.1, 1e-13);
  EXPECT_NEAR(errors.length_max, 0.1, 1e-13);
  EXPECT_TRUE(std::isnan(errors.volume_mean));
  EXPECT_TRUE(std::isnan(errors.volume_max));
  EXPECT_EQ(errors.inverted, 0);
  const Matrix3 rotation = Eigen::AngleAxisd(2.1, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  EXPECT_LT(measure.rest_error(pack(rotation * sheet.vertices)), 1e-14) << "flat, and yet there is a best rotation";
}

TEST(ShapeMeasure, StrainsOfAVertexAreMeansOverItsEdges) {
  Eigen::Matrix3Xd rest(3, 4);
  rest << 0, 1, 0, 5,  //
      0, 0, 2, 5,      //
      0, 0, 0, 5;
  const ShapeMeasure measure(rest, std::vector<Edge>{{0, 1}, {0, 2}});
  PackedVectors x = pack(rest);
  x(0, 1) = 1.5;
  x(1, 2) = 1.8;
  EXPECT_LT((measure.vertex_strains(x) - Eigen::Vector4d(0.3, 0.5, 0.1, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace penalty::demo
