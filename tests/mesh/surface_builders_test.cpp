#include "penalty/mesh/surface_builders.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "files.h"

namespace penalty::testing {
namespace {

int euler_characteristic(const TriangleSurface& surface) {
  return static_cast<int>(surface.vertices.cols()) - static_cast<int>(edges_of(surface.triangles).size()) +
         static_cast<int>(surface.triangles.size());
}

TEST(MakeSheet, CoversTheRectangleOnceWithItsFrontUp) {
  for (const Diagonals diagonals : {Diagonals::alternating, Diagonals::one_way}) {
    const TriangleSurface sheet = make_sheet(3, 2, 6, 5, diagonals);
    EXPECT_EQ(sheet.vertices.cols(), 7 * 6);
    EXPECT_EQ(sheet.triangles.size(), 2u * 6 * 5);
    EXPECT_EQ(edges_of(sheet.triangles).size(), 6u * 6 + 7 * 5 + 6 * 5);
    EXPECT_EQ(euler_characteristic(sheet), 1) << "a disc";
    EXPECT_EQ(sheet.vertices.rowwise().minCoeff(), Vector3(0, 0, 0));
    EXPECT_EQ(sheet.vertices.rowwise().maxCoeff(), Vector3(3, 2, 0));
    EXPECT_EQ(sheet.vertices.col(6 + 1), Vector3(0, 0.4, 0)) << "row by row";
    for (const auto& [a, b, c] : sheet.triangles) {
      const Vector3 u = sheet.vertices.col(b) - sheet.vertices.col(a),
                    v = sheet.vertices.col(c) - sheet.vertices.col(a);
      EXPECT_NEAR(u.cross(v).z(), 0.5 * 0.4, 1e-15);
    }
    EXPECT_NEAR(area(sheet), 6, 1e-14);
    EXPECT_EQ(hinges_of(sheet.triangles).size(), 6u * 5 + 5 * 5 + 6 * 4) << "diagonals and inner sides";
  }
}

TEST(MakeSheet, TurnsItsDiagonalsFromCellToCellOrNot) {
  const auto rising = [](Diagonals diagonals) {
    const TriangleSurface sheet = make_sheet(4, 4, 4, 4, diagonals);
    int count = 0;
    for (const auto& [a, b] : edges_of(sheet.triangles)) {
      const Vector3 d = sheet.vertices.col(b) - sheet.vertices.col(a);
      count += d.x() * d.y() > 0;
    }
    return count;
  };
  EXPECT_EQ(rising(Diagonals::one_way), 16);
  EXPECT_EQ(rising(Diagonals::alternating), 8);
}

TEST(MakeSphere, IsClosedAndOutward) {
  for (const int n : {1, 2, 5, 12}) {
    const TriangleSurface sphere = make_sphere(2, n);
    EXPECT_EQ(sphere.vertices.cols(), 10 * n * n + 2);
    EXPECT_EQ(static_cast<int>(sphere.triangles.size()), 20 * n * n);
    EXPECT_EQ(euler_characteristic(sphere), 2);
    EXPECT_EQ(hinges_of(sphere.triangles).size(), edges_of(sphere.triangles).size()) << "no rim";
    for (const auto& [a, b, c] : sphere.triangles) {
      const Vector3 p = sphere.vertices.col(a), q = sphere.vertices.col(b), r = sphere.vertices.col(c);
      EXPECT_GT((q - p).cross(r - p).dot(p + q + r), 0);
    }
    EXPECT_NEAR(sphere.vertices.colwise().norm().minCoeff(), 2, 1e-14);
    EXPECT_NEAR(sphere.vertices.colwise().norm().maxCoeff(), 2, 1e-14);
    TriangleSurface repaired = sphere;
    repair(repaired);
    EXPECT_EQ(repaired.triangles, sphere.triangles);
  }
}

TEST(MakeSphere, AreaAndVolumeConvergeToTheClosedFormsWithTheSquareOfTheSubdivisions) {
  const Real whole = 4 * std::numbers::pi;
  const TriangleSurface coarse = make_sphere(1, 8), fine = make_sphere(1, 16);
  EXPECT_LT(whole - area(fine), 0.01 * whole);
  EXPECT_NEAR((whole - area(coarse)) / (whole - area(fine)), 4, 0.05);
  EXPECT_NEAR((whole / 3 - volume(coarse)) / (whole / 3 - volume(fine)), 4, 0.05);
}

TEST(MakeSphere, HasTrianglesOfNearlyOneSize) {
  const TriangleSurface sphere = make_sphere(1, 10);
  const std::vector<Real> areas = areas_of(sphere.vertices, sphere.triangles);
  EXPECT_LT(*std::max_element(areas.begin(), areas.end()), 1.5 * *std::min_element(areas.begin(), areas.end()));
}

TEST(SurfaceBuilders, NameTheArgumentTheyRefuse) {
  const Real infinity = std::numeric_limits<Real>::infinity();
  EXPECT_EQ(invalid_argument([] { make_sheet(0, 1, 1, 1); }), "make_sheet: width is 0, not a positive finite length");
  EXPECT_EQ(invalid_argument([&] { make_sheet(1, infinity, 1, 1); }),
            "make_sheet: height is inf, not a positive finite length");
  EXPECT_EQ(invalid_argument([] { make_sheet(1, 1, 0, 1); }), "make_sheet: cells_x is 0, not between 1 and 100000000");
  EXPECT_EQ(invalid_argument([] { make_sheet(1, 1, 1, -1); }),
            "make_sheet: cells_y is -1, not between 1 and 100000000");
  EXPECT_EQ(invalid_argument([] { make_sheet(1, 1, 100000, 100000); }),
            "make_sheet: cells are more than 100000000 together");
  EXPECT_EQ(invalid_argument([] { make_sphere(-1, 4); }), "make_sphere: radius is -1, not a positive finite length");
  EXPECT_EQ(invalid_argument([] { make_sphere(1, 251); }), "make_sphere: subdivisions is 251, not between 1 and 250");
}

}  // namespace
}  // namespace penalty::testing
