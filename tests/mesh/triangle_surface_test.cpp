#include "penalty/mesh/triangle_surface.h"

#include <cmath>
#include <random>

#include "files.h"
#include "surfaces.h"

namespace penalty::testing {
namespace {

TriangleSurface cube() {
  TriangleSurface surface = boundary_surface(make_box({1, 1, 1}, {2, 2, 2}));
  surface.source = "cube";
  return surface;
}

TEST(RepairSurface, KeepsAClosedSurfaceAndDropsInnerVertices) {
  TriangleSurface surface = cube();
  repair(surface);
  EXPECT_EQ(surface.vertices.cols(), 26);
  EXPECT_EQ(surface.triangles.size(), 48u);
  EXPECT_EQ(surface.repairs.dropped_vertices, 1);
  EXPECT_EQ(surface.repairs.merged_vertices, 0);
  EXPECT_FALSE(surface.repairs.flipped);
  EXPECT_NEAR(volume(surface), 1, 1e-15);
  TriangleSurface again = surface;
  repair(again);
  EXPECT_EQ(again.vertices, surface.vertices);
  EXPECT_EQ(again.triangles, surface.triangles);
}

TEST(RepairSurface, VolumeMatchesTheTetrahedraFarFromTheOrigin) {
  TetMesh torus = make_torus();
  const Real expected = volume(torus);
  torus.vertices.colwise() += Vector3(1e6, -1e6, 1e6);
  TriangleSurface surface = boundary_surface(torus);
  repair(surface);
  EXPECT_NEAR(volume(surface), expected, 1e-8);
}

TEST(RepairSurface, MergesASoupWithinTheTolerance) {
  constexpr unsigned seed = 3;
  std::mt19937 random(seed);
  std::uniform_real_distribution<Real> jitter(-1e-8, 1e-8);
  for (bool exact : {true, false}) {
    TriangleSurface surface = soup(cube());
    if (!exact)
      for (Eigen::Index i = 0; i < surface.vertices.size(); ++i) surface.vertices.data()[i] += jitter(random);
    repair(surface, exact ? 0 : 1e-7);
    EXPECT_EQ(surface.vertices.cols(), 26) << "seed " << seed;
    EXPECT_EQ(surface.triangles.size(), 48u);
    EXPECT_EQ(surface.repairs.merged_vertices, 48 * 3 - 26);
    EXPECT_EQ(surface.repairs.dropped_vertices, 0);
  }
}

TEST(RepairSurface, DropsTrianglesThatMergingCollapses) {
  TriangleSurface surface = cube();
  const Triangle t = surface.triangles[0];
  surface.triangles.push_back({t[0], t[0], t[1]});
  repair(surface);
  EXPECT_EQ(surface.repairs.dropped_triangles, 1);
  EXPECT_EQ(surface.triangles.size(), 48u);
}

TEST(RepairSurface, TurnsASurfaceThatIsInsideOut) {
  TriangleSurface surface = inside_out(cube());
  repair(surface);
  EXPECT_TRUE(surface.repairs.flipped);
  EXPECT_NEAR(volume(surface), 1, 1e-15);
}

TEST(RepairSurface, NamesWhatItRefuses) {
  const auto complaint = [](auto spoil) {
    TriangleSurface surface = cube();
    spoil(surface);
    return invalid_argument([&] { repair(surface); });
  };
  EXPECT_EQ(complaint([](TriangleSurface& s) { s.triangles.clear(); }), "cube: the surface has no triangles");
  EXPECT_EQ(complaint([](TriangleSurface& s) { s.vertices(2, 5) = std::nan(""); }),
            "cube: vertex 5: coordinate z is nan");
  EXPECT_EQ(complaint([](TriangleSurface& s) { s.triangles[3][1] = 27; }),
            "cube: triangle 3: vertex index 27 is outside 0 to 26");
  EXPECT_EQ(
      complaint([](TriangleSurface& s) { s.triangles = {{0, 1, 3}}; }),
      "cube: the surface is open: the edge from vertex (0, 0, 0) to vertex (0, 0, 0.5) belongs to one triangle only");
  EXPECT_NE(
      complaint([](TriangleSurface& s) { s.triangles.pop_back(); }).find("cube: the surface is open: the edge from"),
      std::string::npos);
  EXPECT_NE(complaint([](TriangleSurface& s) { s.triangles.push_back(s.triangles[7]); }).find("belongs to 3 triangles"),
            std::string::npos);
  EXPECT_NE(complaint([](TriangleSurface& s) {
              std::swap(s.triangles[7][0], s.triangles[7][1]);
            }).find("cube: neighbouring triangles face opposite sides: both run through the edge from vertex ("),
            std::string::npos);
  EXPECT_EQ(complaint([](TriangleSurface& s) { s.triangles = {{0, 1, 3}, {0, 3, 1}}; }),
            "cube: the surface encloses a volume of 0");
  TriangleSurface surface = cube();
  EXPECT_EQ(invalid_argument([&] { repair(surface, -1); }), "repair: merge_tolerance is -1, not between 0 and 1");
}

}  // namespace
}  // namespace penalty::testing
