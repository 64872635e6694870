#include "penalty/contact/contact_surface.h"

#include "contact/surfaces.h"

namespace penalty::testing {
namespace {

TEST(ContactSurface, BelongsToItsPatchesOnceAndWhole) {
  const ContactSurface surface = surface_of(make_sphere(1, 12));
  ASSERT_GT(surface.patches().size(), 10u);
  std::vector<int> points, edges, triangles;
  for (const SurfacePatch& patch : surface.patches()) {
    points.insert(points.end(), patch.points.begin(), patch.points.end());
    edges.insert(edges.end(), patch.edges.begin(), patch.edges.end());
    triangles.insert(triangles.end(), patch.triangles.begin(), patch.triangles.end());
    EXPECT_LE(patch.triangles.size(), 64u);
    for (const int t : patch.triangles)
      for (const int point : surface.triangles()[t])
        EXPECT_TRUE(std::binary_search(patch.all_points.begin(), patch.all_points.end(), point));
  }
  const auto expect_each_once = [](std::vector<int> items, std::size_t count) {
    std::sort(items.begin(), items.end());
    ASSERT_EQ(items.size(), count);
    for (std::size_t k = 0; k < count; ++k) EXPECT_EQ(items[k], static_cast<int>(k));
  };
  expect_each_once(points, surface.points().size());
  expect_each_once(edges, surface.edges().size());
  expect_each_once(triangles, surface.triangles().size());
}

TEST(ContactSurface, IsClosedOrOpen) {
  EXPECT_TRUE(surface_of(make_sphere(1, 3)).is_closed());
  EXPECT_FALSE(surface_of(make_sheet(1, 1, 3, 3)).is_closed());
  TriangleSurface torn = make_sphere(1, 3);
  torn.triangles.pop_back();
  EXPECT_FALSE(surface_of(torn).is_closed());
  TriangleSurface twisted = make_sphere(1, 3);
  std::swap(twisted.triangles[0][0], twisted.triangles[0][1]);
  EXPECT_FALSE(surface_of(twisted).is_closed()) << "a triangle that looks the other way has no inside";
}

TEST(ContactSurface, LooksOutwardsIfItIsClosed) {
  TriangleSurface inwards = make_sphere(1, 3);
  for (Triangle& t : inwards.triangles) std::swap(t[0], t[1]);
  EXPECT_NEAR(surface_of(inwards).winding_number({0.1, 0.2, 0.1}), 1, 1e-9);
}

TEST(ContactSurface, BeginsItsAccountsAnewWhenItForgets) {
  ContactSurface sphere = surface_of(make_sphere(1, 3));
  sphere.take_velocities(PackedVectors::Constant(4, sphere.points().size(), 1e300));
  sphere.drift(1e300);  // an attempt that overflowed
  sphere.forget();
  for (const SurfacePatch& patch : sphere.patches()) {
    EXPECT_EQ(patch.path, 0);
    EXPECT_EQ(patch.shift, Vector3(0, 0, 0));
  }
}

TEST(ContactSurface, WindsOnceAroundWhatIsInside) {
  ContactSurface sphere = surface_of(make_sphere(1, 6));
  Random random(4);
  for (int k = 0; k < 200; ++k) {
    const Vector3 x = random.vector(1.5);
    if (std::abs(x.norm() - 1) < 0.03) continue;  // the facets lie a little inside
    EXPECT_NEAR(sphere.winding_number(x), x.norm() < 1 ? 1 : 0, 1e-9);
  }
}

TEST(ContactSurface, MovesWithItsParticles) {
  // A point between two particles, one at a particle; edges of no triangle.
  const std::vector<WeightedPoint> points{{{0, 1}, {0.25, 0.75}, 2}, WeightedPoint::at_particle(2)};
  PackedVectors rest = PackedVectors::Zero(4, 3);
  rest(0, 1) = 4;
  rest(1, 2) = 2;
  ContactSurface rope(points, {}, {{0, 1}}, rest);
  EXPECT_EQ(rope.position(0), Vector3(3, 0, 0));
  EXPECT_EQ(rope.edges().size(), 1u);
  EXPECT_NEAR(rope.mean_edge(), std::sqrt(13.0), 1e-15);
  rest(2, 0) = 4;
  const std::uint64_t epoch = rope.epoch();
  rope.begin_step(rest);
  EXPECT_EQ(rope.position(0), Vector3(3, 0, 1));
  EXPECT_NE(rope.epoch(), epoch) << "somebody else moved it";
  rope.begin_step(rest);
  EXPECT_EQ(rope.epoch(), epoch + 1);
}

TEST(ContactSurface, RefusesIndicesOutsideThePoints) {
  const PackedVectors rest = PackedVectors::Zero(4, 2);
  const std::vector<WeightedPoint> points{WeightedPoint::at_particle(0), WeightedPoint::at_particle(1)};
  const auto message = [&](const std::vector<Triangle>& triangles, const std::vector<Edge>& edges) -> std::string {
    try {
      const ContactSurface taken(points, triangles, edges, rest);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({{0, 1, 2}}, {}), "contact surface: triangle 0: index 2 is outside the 2 points");
  EXPECT_EQ(message({}, {{0, 1}, {-1, 0}}), "contact surface: edge 1: index -1 is outside the 2 points");
  try {
    const ContactSurface taken({WeightedPoint::at_particle(0), WeightedPoint::at_particle(7)}, {}, {}, rest);
    FAIL() << "took a point of no particle, " << taken.points().size();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "contact surface: point 1: index 7 is outside the 2 nodes");
  }
}

}  // namespace
}  // namespace penalty::testing
