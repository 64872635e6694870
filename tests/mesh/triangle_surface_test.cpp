#include "penalty/mesh/triangle_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
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

TEST(RepairSurface, DropsDoubledTrianglesWhicheverWayRound) {
  TriangleSurface surface = cube();
  for (const int k : {0, 7, 30}) {
    const Triangle t = surface.triangles[k];
    surface.triangles.push_back(k == 7 ? Triangle{t[1], t[2], t[0]} : Triangle{t[2], t[1], t[0]});
  }
  repair(surface);
  EXPECT_EQ(surface.repairs.doubled_triangles, 3);
  EXPECT_EQ(to_text(surface.repairs), "dropped 1 vertex of no triangle, dropped 3 doubled triangles");
  check_closed(surface);
  EXPECT_NEAR(volume(surface), 1, 1e-15);
}

TEST(RepairSurface, TurnsTrianglesToTheSideOfMost) {
  constexpr unsigned seed = 5;
  std::mt19937 random(seed);
  for (const int turned : {1, 2, 10, 23, 25, 47}) {
    SCOPED_TRACE(std::to_string(turned) + " turned, seed " + std::to_string(seed));
    TriangleSurface surface = cube();
    std::shuffle(surface.triangles.begin(), surface.triangles.end(), random);
    for (int k = 0; k < turned; ++k) std::swap(surface.triangles[k][0], surface.triangles[k][1]);
    repair(surface);
    EXPECT_EQ(surface.repairs.turned_triangles, std::min(turned, 48 - turned));
    EXPECT_EQ(surface.repairs.flipped, turned > 24);
    check_closed(surface);
    EXPECT_NEAR(volume(surface), 1, 1e-15);
  }
}

TEST(RepairSurface, TakesOpenOnes) {
  TriangleSurface surface = cube();
  surface.triangles.erase(surface.triangles.begin() + 5);
  std::swap(surface.triangles[9][0], surface.triangles[9][1]);
  repair(surface);
  EXPECT_EQ(surface.triangles.size(), 47u);
  EXPECT_EQ(surface.repairs.turned_triangles, 1);
  const SurfaceTopology topology = topology_of(surface);
  EXPECT_EQ(topology.open_edges, 3);
  EXPECT_EQ(topology.branching_edges + topology.opposed_edges, 0);
  EXPECT_EQ(topology.pieces, 1);
  EXPECT_FALSE(topology.is_closed());
}

TEST(RepairSurface, LeavesAMoebiusStripWithOneEdgeThatOpposes) {
  constexpr int turns = 20;
  TriangleSurface strip{Eigen::Matrix3Xd(3, 2 * turns), {}, "strip", {}};
  for (int k = 0; k < turns; ++k) {
    const Real angle = 2 * std::numbers::pi * k / turns, half = angle / 2;
    for (const int side : {0, 1}) {
      const Real r = 1 + (side == 0 ? -0.2 : 0.2) * std::cos(half);
      strip.vertices.col(2 * k + side) =
          Vector3(r * std::cos(angle), r * std::sin(angle), (side == 0 ? -0.2 : 0.2) * std::sin(half));
    }
    const int a = 2 * k, b = a + 1, c = k + 1 < turns ? a + 2 : 1, d = k + 1 < turns ? a + 3 : 0;
    strip.triangles.push_back({a, c, b});
    strip.triangles.push_back({b, c, d});
  }
  repair(strip);
  const SurfaceTopology topology = topology_of(strip);
  EXPECT_EQ(topology.opposed_edges, 1);
  EXPECT_EQ(topology.open_edges, 2 * turns);
  EXPECT_EQ(topology.pieces, 1);
}

TEST(Pieces, AreBodiesWithTheirCavities) {
  const auto at = [](TriangleSurface surface, Real x) {
    surface.vertices.row(0).array() += x;
    return surface;
  };
  const auto ball = [](Real radius) { return boundary_surface(make_ball(radius, 6)); };
  TriangleSurface all = together(ball(0.3), at(ball(1), 5));  // 0.3 lies in the next one
  all = together(all, inside_out(ball(0.8)));
  all = together(all, ball(1));
  all = together(all, at(cube(), 2));
  repair(all);
  EXPECT_EQ(topology_of(all).pieces, 5);
  const std::vector<TriangleSurface> pieces = pieces_of(all);
  ASSERT_EQ(pieces.size(), 3u);
  const Real unit = volume(ball(1));
  EXPECT_NEAR(volume(pieces[0]), unit, 1e-12);
  EXPECT_EQ(pieces[0].vertices.row(0).minCoeff(), 4);
  EXPECT_NEAR(volume(pieces[1]), unit * (1 - 0.512 + 0.027), 1e-12);
  EXPECT_NEAR(volume(pieces[2]), 1, 1e-12);
  for (const TriangleSurface& piece : pieces) check_closed(piece);
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
  TriangleSurface surface = cube();
  EXPECT_EQ(invalid_argument([&] { repair(surface, -1); }), "repair: merge_tolerance is -1, not between 0 and 1");
}

TEST(CheckClosed, NamesTheEdge) {
  const auto complaint = [](auto spoil) {
    TriangleSurface surface = cube();
    spoil(surface);
    return invalid_argument([&] { check_closed(surface); });
  };
  EXPECT_EQ(complaint([](TriangleSurface&) {}), "");
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
}

}  // namespace
}  // namespace penalty::testing
