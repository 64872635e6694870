#include "scenes/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "penalty/mesh/triangle_surface.h"

namespace penalty::demo {
namespace {

constexpr Real pi = std::numbers::pi;
const Vector3 center(0.03, -0.02, 0.05);  // off the grid

Real distance(const Vector3& p) { return (p - center).norm(); }

Isosurface sphere(int cells, Real radius = 0.7) { return isosurface(distance, radius, {-1, -1, -1}, {1, 1, 1}, cells); }

Real area_of(const Isosurface& s) { return area({s.vertices, s.triangles, {}, {}}); }
Real volume_of(const Isosurface& s) { return volume({s.vertices, s.triangles, {}, {}}); }

TEST(IsosurfaceOfASphere, LiesOnTheSphere) {
  const Isosurface surface = sphere(20);
  ASSERT_GT(surface.vertices.cols(), 500);
  const auto radii = (surface.vertices.colwise() - center).colwise().norm().eval();
  EXPECT_NEAR(radii.minCoeff(), 0.7, 1e-7);
  EXPECT_NEAR(radii.maxCoeff(), 0.7, 1e-7);
}

TEST(IsosurfaceOfASphere, IsClosedAndLooksOutwards) {
  const Isosurface surface = sphere(20);
  EXPECT_EQ(hinges_of(surface.triangles).size(), edges_of(surface.triangles).size()) << "no rim, one orientation";
  const auto euler = surface.vertices.cols() - static_cast<Eigen::Index>(edges_of(surface.triangles).size()) +
                     static_cast<Eigen::Index>(surface.triangles.size());
  EXPECT_EQ(euler, 2);
  EXPECT_GT(volume_of(surface), 0);
  const Eigen::Matrix3Xd outward = normals(surface);
  Real worst = 1;
  for (Eigen::Index v = 0; v < outward.cols(); ++v)
    worst = std::min(worst, outward.col(v).dot((surface.vertices.col(v) - center).normalized()));
  EXPECT_GT(worst, 1 - 1e-9) << "exact on a sphere";
}

TEST(IsosurfaceOfASphere, AreaAndVolumeConvergeWithTheSquareOfTheCells) {
  const Real area = 4 * pi * 0.49, volume = area * 0.7 / 3;
  const Isosurface coarse = sphere(16), fine = sphere(32);
  EXPECT_NEAR(area_of(fine), area, 0.005 * area);
  EXPECT_NEAR((area - area_of(coarse)) / (area - area_of(fine)), 4, 0.4);
  EXPECT_NEAR((volume - volume_of(coarse)) / (volume - volume_of(fine)), 4, 0.4);
}

TEST(Isosurface, OfAPlaneIsExact) {
  const Vector3 normal = Vector3(1, 2, -0.5).normalized();
  const Isosurface plane = isosurface([&](const Vector3& p) { return normal.dot(p); }, 0.1, {-1, -1, -1}, {1, 1, 1}, 7);
  ASSERT_FALSE(plane.triangles.empty());
  for (Eigen::Index v = 0; v < plane.vertices.cols(); ++v) EXPECT_NEAR(normal.dot(plane.vertices.col(v)), 0.1, 1e-12);
  const Eigen::Matrix3Xd up = normals(plane);
  for (Eigen::Index v = 0; v < up.cols(); ++v) EXPECT_GT(up.col(v).dot(normal), 1 - 1e-9);
}

TEST(Isosurface, IsEmptyWhereTheLevelIsNotReachedAndShunsWhatIsNotFinite) {
  EXPECT_TRUE(sphere(8, 5).triangles.empty());
  const SpaceFunction spoilt = [](const Vector3& p) {
    return p.x() > 0.5 ? std::numeric_limits<Real>::quiet_NaN() : distance(p);
  };
  const Isosurface surface = isosurface(spoilt, 0.7, {-1, -1, -1}, {1, 1, 1}, 12);
  ASSERT_FALSE(surface.triangles.empty());
  EXPECT_TRUE(surface.vertices.allFinite());
  EXPECT_LT(surface.vertices.row(0).maxCoeff(), 0.5 + 1e-6);
}

TEST(Clipped, HalfASphereHasHalfTheAreaAndAStraightRim) {
  const Isosurface whole = sphere(32);
  const Isosurface half = clipped(whole, [](const Vector3& p) { return p.x() - center.x(); });
  EXPECT_NEAR(area_of(half), area_of(whole) / 2, 2e-3 * area_of(whole));
  EXPECT_LT(half.vertices.row(0).maxCoeff(), center.x() + 1e-9);
  EXPECT_GT(half.vertices.row(0).maxCoeff(), center.x() - 1e-9);
  const Isosurface other = clipped(whole, [](const Vector3& p) { return center.x() - p.x(); });
  EXPECT_NEAR(area_of(half) + area_of(other), area_of(whole), 1e-9);
  const std::size_t inner = hinges_of(half.triangles).size(), all = edges_of(half.triangles).size();
  EXPECT_GT(all, inner) << "it has a rim";
  EXPECT_EQ(clipped(whole, [](const Vector3&) { return -1; }).triangles, whole.triangles);
  EXPECT_TRUE(clipped(whole, [](const Vector3&) { return 1; }).triangles.empty());
}

}  // namespace
}  // namespace penalty::demo
