// What the claims of contact scenes are measured by.
#include "scenes/drawn_surface.h"

#include <gtest/gtest.h>

#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::demo {
namespace {

DrawnSurface box_at(const Vector3& corner, int cells = 2) {
  const BodyMesh mesh{make_box({1, 1, 1}, {cells, cells, cells})};
  DrawnSurface surface(mesh);
  surface.move_to(pack(mesh.vertices().colwise() + corner));
  return surface;
}

TEST(DrawnSurface, CountsEdgesThatGoThroughTriangles) {
  const DrawnSurface box = box_at({0, 0, 0});
  EXPECT_EQ(box.crossings(box), 0);
  EXPECT_EQ(box.crossings(box_at({1.01, 0, 0})), 0);
  const DrawnSurface pushed_in = box_at({0.93, 0.33, 0.21});
  EXPECT_GT(box.crossings(pushed_in) + pushed_in.crossings(box), 0);
  EXPECT_TRUE(overlap(box, pushed_in));
  EXPECT_FALSE(overlap(box, box_at({1.01, 0, 0})));
}

TEST(DrawnSurface, CrossesItselfWhereItIsPushedThroughItself) {
  const BodyMesh sheet{make_sheet(3, 1, 3, 1)};
  DrawnSurface folded(sheet);
  Eigen::Matrix3Xd x = sheet.vertices();
  ASSERT_EQ(folded.crossings(folded), 0);
  // A loop in its own length: the last column goes through the first cell.
  for (int i = 0; i < x.cols(); ++i) {
    if (x(0, i) > 1.5) x.col(i) = Vector3(1, x(1, i) + 0.1, 1);
    if (sheet.vertices()(0, i) > 2.5) x.col(i) = Vector3(0.4, x(1, i) + 0.1, -1);
  }
  folded.move_to(pack(x));
  EXPECT_GT(folded.crossings(folded), 0);
}

TEST(DrawnSurface, OneInsideTheOtherOverlapsWithoutACrossing) {
  const BodyMesh mesh{make_box({1, 1, 1}, {1, 1, 1})};
  DrawnSurface small(mesh);
  small.move_to(pack((0.1 * mesh.vertices()).colwise() + Vector3(0.4, 0.45, 0.4)));
  const DrawnSurface box = box_at({0, 0, 0});
  EXPECT_EQ(box.crossings(small) + small.crossings(box), 0);
  EXPECT_TRUE(overlap(box, small));
  EXPECT_TRUE(overlap(small, box));
  EXPECT_TRUE(box.encloses({0.9, 0.1, 0.5}));
  EXPECT_FALSE(box.encloses({1.1, 0.1, 0.5}));
}

TEST(DrawnSurface, DistancesAreThoseOfItsTriangles) {
  const DrawnSurface box = box_at({0, 0, 0}, 3);
  EXPECT_NEAR(box.distance(Vector3(0.5, 1.25, 0.4)), 0.25, 1e-12);
  EXPECT_NEAR(box.distance(Vector3(1.3, 1.4, 0.4)), 0.5, 1e-12);
  EXPECT_NEAR(box.distance(box_at({1.02, 0.1, 0.2}), 0.1), 0.02, 1e-12);
  EXPECT_EQ(box.distance(box_at({1.2, 0, 0}), 0.1), 0.1) << "beyond the reach";
}

TEST(SurfaceWatch, RemembersWhatItSaw) {
  const BodyMesh mesh{make_box({1, 1, 1}, {2, 2, 2})};
  const PotentialField none(mesh.vertices());
  Particles left{.positions = pack(mesh.vertices()), .velocities = {}, .inverse_masses = {}}, right = left;
  const auto push = [&](const Vector3& by) { right.positions = pack(mesh.vertices().colwise() + by); };
  SurfaceWatch watch({mesh, mesh}, 0.05);
  const SceneState state{.bodies = {{left, none}, {right, none}}};
  push({1.03, 0, 0});
  watch.see(state);
  EXPECT_EQ(watch.crossings(), 0);
  EXPECT_NEAR(watch.least_distance(), 0.03, 1e-12);
  push({0.93, 0.33, 0.21});
  watch.see(state);
  EXPECT_EQ(watch.overlapping_pairs(), 1);
  const long crossings = watch.crossings();
  EXPECT_GT(crossings, 0);
  push({2, 0, 0});
  watch.see(state);
  EXPECT_EQ(watch.overlapping_pairs(), 0);
  EXPECT_EQ(watch.crossings(), crossings);
  EXPECT_EQ(watch.self_crossings(), 0);
}

}  // namespace
}  // namespace penalty::demo
