// The planes between a point and the triangles near it, against closed forms.
#include "mesh_contact.h"

#include "bullet/meshes.h"

namespace penalty::testing {
namespace {

std::vector<MeshTriangle> contact_triangles_of(const MeshData& data) {
  const MeshShape shape(data, 0);
  std::vector<MeshTriangle> triangles;
  append_triangles(shape, {Vector3::Constant(-100), Vector3::Constant(100)}, triangles);
  return triangles;
}

std::vector<SurfacePoint> planes(const MeshData& data, const MovingPoint& point, Real mesh_margin = 0,
                                 Real reach = 100) {
  std::vector<MeshTriangle> triangles = contact_triangles_of(data);
  std::vector<SurfacePoint> found;
  append_planes(triangles, point, mesh_margin, reach, found);
  return found;
}

TEST(MeshContact, KeepsThePointOnTheSideWhereItIs) {
  const Vector3 half(0.5, 0.4, 0.7);
  Random random(11);
  int inside = 0;
  for (const bool turned : {false, true}) {
    const MeshData box = turned ? box_mesh(half).turned() : box_mesh(half);
    for (int k = 0; k < 500; ++k) {
      const Vector3 p = random.vector(1.5);
      SCOPED_TRACE(::testing::Message() << "sample " << k << " at " << p.transpose());
      const Real distance = box_distance(p, half);
      inside += distance < 0;
      const std::vector<SurfacePoint> found = planes(box, {.position = p});
      ASSERT_FALSE(found.empty());
      EXPECT_NEAR(found[0].distance, std::abs(distance), limit(1e-12, 1e-6)) << "the nearest comes first";
      EXPECT_NEAR(box_distance(found[0].point, half), 0, limit(1e-12, 1e-6));
      EXPECT_NEAR(found[0].normal.norm(), 1, 1e-12);
      EXPECT_LT((p - found[0].distance * found[0].normal - found[0].point).norm(), 1e-12);
      for (const SurfacePoint& plane : found) EXPECT_GE(plane.distance, 0);
    }
  }
  EXPECT_GT(inside, 20);
}

TEST(MeshContact, IsLiftedByTheMarginOfTheMeshOnBothSides) {
  for (const Real y : {0.5, -0.5}) {
    const std::vector<SurfacePoint> found = planes(sheet_mesh(1, 1, 4), {.position = {0.1, y, 0.2}}, 0.1);
    ASSERT_EQ(found.size(), 1u) << "what lies in the same plane needs no other";
    EXPECT_NEAR(found[0].distance, 0.4, 1e-7);
    EXPECT_NEAR(found[0].point.y(), y > 0 ? 0.1 : -0.1, 1e-7);
    EXPECT_NEAR(found[0].normal.y(), y > 0 ? 1 : -1, 1e-7);
  }
}

TEST(MeshContact, OfAPointOnATriangleIsItsPlane) {
  const std::vector<SurfacePoint> found = planes(sheet_mesh(1, 1), {.position = {0.3, 0, 0.2}});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].distance, 0);
  EXPECT_EQ(std::abs(found[0].normal.y()), 1);
}

TEST(MeshContact, BeyondItsReachNothingIsFound) {
  EXPECT_TRUE(planes(sheet_mesh(1, 1), {.position = {0, 0.5, 0}}, 0.1, 0.39).empty());
  EXPECT_EQ(planes(sheet_mesh(1, 1), {.position = {0, 0.5, 0}}, 0.1, 0.41).size(), 1u);
}

// Whatever way a point goes in a room, one of the planes is in its way before the wall is.
TEST(MeshContact, NoWayLeadsOutOfARoom) {
  const Vector3 half(1, 0.7, 0.9);
  Random random(3);
  for (const bool turned : {false, true}) {
    const MeshData room = turned ? box_mesh(half).turned() : box_mesh(half);
    for (int k = 0; k < 300; ++k) {
      const Vector3 p = half.cwiseProduct(random.vector(1));
      const Vector3 way = 10 * random.vector(1);
      const std::vector<SurfacePoint> found = planes(room, {.position = p, .way = way}, 0);
      Real inside = 1;  // share of another way after which a plane is reached
      const Vector3 other = (way + random.vector(5)).normalized() * way.norm();
      for (const SurfacePoint& plane : found)
        if (const Real speed = -plane.normal.dot(other); speed > 0) inside = std::min(inside, plane.distance / speed);
      ASSERT_LE(box_distance(p + inside * other, half), 1e-6) << "sample " << k;
    }
  }
}

// Along a floor that meets a slope: it is the slope itself that is hit, not the edge between them.
TEST(MeshContact, WhatIsHitIsTheFaceAndNotItsEdge) {
  const MeshData valley = extruded_mesh({{-2, 0}, {0, 0}, {2, 0.5}}, 2);
  const Real margin = 0.06;
  const Vector3 slope = Vector3(-0.5, 2, 0).normalized();
  const std::vector<SurfacePoint> found =
      planes(valley, {.position = {-0.2, margin, 0}, .way = {0.5, 0, 0}, .margin = margin});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_LT((found[0].normal - Vector3::UnitY()).norm(), 1e-6);
  EXPECT_LT((found[1].normal - slope).norm(), 1e-6);
  EXPECT_NEAR(found[1].distance, slope.dot(Vector3(-0.2, margin, 0)), 1e-6);
}

TEST(MeshContact, AFenceIsNotInTheWayOfWhatFliesOverIt) {
  const MeshData fence = extruded_mesh({{1, 0}, {1, 0.5}}, 2);
  const Vector3 from(0.3, 0.7, 0), way(1.5, 0, 0);
  const MeshData ground = sheet_mesh(3, 3);
  const std::vector<SurfacePoint> found = planes(ground.with(fence), {.position = from, .way = way, .margin = 0.05});
  ASSERT_EQ(found.size(), 2u);
  for (const SurfacePoint& plane : found)
    EXPECT_GE(plane.distance + plane.normal.dot(way), 0.05) << plane.normal.transpose();
}

TEST(MeshContact, TheWayBackIsThroughTheNearestTriangle) {
  std::vector<MeshTriangle> triangles = contact_triangles_of(box_mesh({1, 1, 1})),
                            sheet = contact_triangles_of(sheet_mesh(1, 1));
  std::vector<SurfacePoint> found;
  EXPECT_EQ(append_way_back(triangles, {0.2, 0.9, 0.1}, 0.04, 0.05, found), WayBack::too_far);
  ASSERT_EQ(append_way_back(triangles, {0.2, 0.9, 0.1}, 0.04, 0.5, found), WayBack::found);
  EXPECT_NEAR(found.back().normal.y(), 1, 1e-7);
  EXPECT_NEAR(found.back().point.y(), 1.04, 1e-7);
  EXPECT_NEAR(found.back().distance, -0.14, 1e-7);
  ASSERT_EQ(append_way_back(triangles, {0.2, 1.1, 0.1}, 0.04, 0.5, found), WayBack::found);
  EXPECT_NEAR(found.back().normal.y(), -1, 1e-7) << "out of the room";
  EXPECT_EQ(append_way_back(sheet, {1.01, -0.001, 0}, 0.04, 0.5, found), WayBack::around_the_rim);
}

// Ways of a regular lattice, whose points, edges and diagonals coincide with those of the mesh.
TEST(MeshContact, ASurfaceHasNoHolesAndNoDoubleEdges) {
  const MeshData sheet = sheet_mesh(1, 1, 4);
  for (const MeshData& mesh : {sheet, sheet.turned(), sheet.with(sheet.turned())}) {
    const std::vector<MeshTriangle> triangles = contact_triangles_of(mesh);
    for (int i = -3; i <= 3; ++i)
      for (int k = -3; k <= 3; ++k) {
        const Vector3 above(i * 0.25, 0.5, k * 0.25);
        for (const Vector3& way : {Vector3(0, -1, 0), Vector3(0.25, -1, 0), Vector3(0.25, -1, 0.25)}) {
          EXPECT_TRUE(crosses(triangles, above, above + way));
          EXPECT_FALSE(crosses(triangles, above, above + 0.4 * way));
          EXPECT_NE(crosses(triangles, above, above + 0.5 * way), crosses(triangles, above + 0.5 * way, above + way))
              << "by way of a point on the mesh";
        }
      }
  }
}

}  // namespace
}  // namespace penalty::testing
