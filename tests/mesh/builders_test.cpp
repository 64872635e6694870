#include "penalty/mesh/builders.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "files.h"

namespace penalty::testing {
namespace {

constexpr Real degree = std::numbers::pi / 180;

// V - E + F of the boundary: 2 for a ball, 0 for a torus.
int boundary_euler_characteristic(const TetMesh& mesh) {
  const std::vector<Triangle> faces = boundary_faces(mesh.tetrahedra);
  std::set<int> vertices;
  for (const Triangle& face : faces) vertices.insert(face.begin(), face.end());
  return static_cast<int>(vertices.size()) - static_cast<int>(edges_of(faces).size()) + static_cast<int>(faces.size());
}

// V - E + F - T: 1 for a ball, 0 for a solid torus. Each inner face belongs to two tetrahedra.
int euler_characteristic(const TetMesh& mesh) {
  const int tetrahedra = static_cast<int>(mesh.tetrahedra.size());
  const int outer = static_cast<int>(boundary_faces(mesh.tetrahedra).size());
  EXPECT_EQ((4 * tetrahedra - outer) % 2, 0);
  return static_cast<int>(mesh.vertices.cols()) - static_cast<int>(edges_of(mesh.tetrahedra).size()) +
         (4 * tetrahedra - outer) / 2 + outer - tetrahedra;
}

void expect_positive(const TetMesh& mesh) {
  for (Real v : signed_volumes(mesh.vertices, mesh.tetrahedra)) ASSERT_GT(v, 0);
}

TEST(MakeBox, MatchesTheReferenceBeams) {
  struct Beam {
    int across, vertices, tetrahedra, edges;
  };
  for (const Beam& beam : {Beam{4, 425, 1280, 1992}, Beam{8, 2673, 10240, 14064}, Beam{17, 22356, 98260, 125817}}) {
    const TetMesh mesh = make_beam(beam.across);
    EXPECT_EQ(mesh.vertices.cols(), beam.vertices);
    EXPECT_EQ(static_cast<int>(mesh.tetrahedra.size()), beam.tetrahedra);
    EXPECT_EQ(static_cast<int>(edges_of(mesh.tetrahedra).size()), beam.edges);
    EXPECT_EQ(mesh.repairs.reoriented, 0);
  }
}

TEST(MakeBox, FillsTheBoxWithoutGapsOrOverlap) {
  const TetMesh mesh = make_box({1, 2, 3}, {2, 5, 3});
  expect_positive(mesh);
  EXPECT_EQ(mesh.tetrahedra.size(), 150u);
  EXPECT_NEAR(volume(mesh), 6, 1e-13);
  EXPECT_EQ(euler_characteristic(mesh), 1);
  EXPECT_EQ(boundary_euler_characteristic(mesh), 2);
  EXPECT_EQ(boundary_faces(mesh.tetrahedra).size(), 4u * (2 * 5 + 5 * 3 + 3 * 2));
  EXPECT_EQ(mesh.vertices.rowwise().minCoeff(), Vector3(0, 0, 0));
  EXPECT_EQ(mesh.vertices.rowwise().maxCoeff(), Vector3(1, 2, 3));
}

TEST(MakeBox, SplitsCellsInSixAroundTheirDiagonal) {
  const TetMesh mesh = make_box({1, 2, 3}, {2, 5, 3}, BoxSplit::six);
  expect_positive(mesh);
  EXPECT_EQ(mesh.tetrahedra.size(), 180u);
  for (const Real v : signed_volumes(mesh.vertices, mesh.tetrahedra))
    EXPECT_NEAR(v, 6.0 / 180, 1e-14) << "all are equal";
  EXPECT_EQ(euler_characteristic(mesh), 1) << "faces match";
  EXPECT_EQ(boundary_euler_characteristic(mesh), 2);
  EXPECT_EQ(boundary_faces(mesh.tetrahedra).size(), 4u * (2 * 5 + 5 * 3 + 3 * 2));
  EXPECT_EQ(mesh.vertices, make_box({1, 2, 3}, {2, 5, 3}).vertices);
  const TetMesh small = make_box({2, 2, 2}, {2, 2, 2}, BoxSplit::six);
  EXPECT_EQ(small.tetrahedra.size(), 48u);
  EXPECT_EQ(small.vertices.cols(), 27);
  EXPECT_NE(small.source, make_box({2, 2, 2}, {2, 2, 2}).source);
}

TEST(MakeBox, NumbersSliceBySliceAcrossTheDirectionOfMostCells) {
  for (const std::array<int, 3>& cells : {std::array{9, 2, 3}, std::array{2, 9, 3}, std::array{2, 3, 9}}) {
    const TetMesh mesh = make_box({1, 1, 1}, cells);
    int widest = 0;
    for (const Edge& edge : edges_of(mesh.tetrahedra)) widest = std::max(widest, edge[1] - edge[0]);
    EXPECT_LE(widest, 12 + 4 + 1);  // a slice of 3 x 4 vertices and a diagonal within the next
  }
  const TetMesh beam = make_beam(2);
  EXPECT_EQ(beam.vertices.col(1), Vector3(0, 0, 0.5));
  EXPECT_EQ(beam.vertices.col(3), Vector3(0, 0.5, 0));
  EXPECT_EQ(beam.vertices.col(9), Vector3(0.5, 0, 0));
}

TEST(MakeBall, IsABallOfTetrahedraCloseToRegular) {
  for (int layers : {1, 2, 3, 7, 12}) {
    const TetMesh mesh = make_ball(2, layers);
    expect_positive(mesh);
    EXPECT_EQ(static_cast<int>(mesh.tetrahedra.size()), 20 * layers * layers * layers);
    EXPECT_EQ(euler_characteristic(mesh), 1);
    EXPECT_EQ(boundary_euler_characteristic(mesh), 2);
    EXPECT_EQ(boundary_faces(mesh.tetrahedra).size(), 20u * layers * layers);
    for (const Triangle& face : boundary_faces(mesh.tetrahedra))
      for (int v : face) EXPECT_NEAR(mesh.vertices.col(v).norm(), 2, 1e-14);
    const MeshQuality q = quality(mesh);
    EXPECT_LT(q.edge_ratio, 2);
    EXPECT_GT(q.smallest_dihedral, 38 * degree);
    EXPECT_LT(q.largest_dihedral, 132 * degree);
    EXPECT_LT(mesh.vertices.col(0).norm(), 1e-15) << "the centre";
  }
}

TEST(MakeBall, VolumeConvergesToTheClosedFormWithTheSquareOfTheLayers) {
  const Real exact = 4 * std::numbers::pi / 3;
  const Real coarse = exact - volume(make_ball(1, 6)), fine = exact - volume(make_ball(1, 12));
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(coarse / fine, 4, 0.1);
}

TEST(MakeTorus, DefaultIsTwoMetresAcrossAndOfGoodQuality) {
  const TetMesh mesh = make_torus();
  expect_positive(mesh);
  EXPECT_EQ(mesh.tetrahedra.size(), 4374u);
  EXPECT_EQ(mesh.vertices.cols(), 999);
  EXPECT_EQ(euler_characteristic(mesh), 0);
  EXPECT_EQ(boundary_euler_characteristic(mesh), 0);
  const Vector3 low = mesh.vertices.rowwise().minCoeff(), high = mesh.vertices.rowwise().maxCoeff();
  EXPECT_NEAR(high.x() - low.x(), 2, 0.02);
  EXPECT_NEAR(high.z() - low.z(), 2, 0.02);
  EXPECT_NEAR(high.y() - low.y(), 0.6, 0.02);
  const MeshQuality q = quality(mesh);
  EXPECT_LT(q.edge_ratio, 1.88);
  EXPECT_GT(q.smallest_dihedral, 39 * degree);
  EXPECT_LT(q.largest_dihedral, 109 * degree);
}

TEST(MakeTorus, VolumeConvergesToTheClosedForm) {
  const Real exact = 2 * std::numbers::pi * std::numbers::pi * 0.7 * 0.3 * 0.3;
  const Real coarse = exact - volume(make_torus(0.7, 0.3, 3, 27)), fine = exact - volume(make_torus(0.7, 0.3, 6, 54));
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(coarse / fine, 4, 0.2);
  EXPECT_EQ(euler_characteristic(make_torus(0.7, 0.3, 1, 3)), 0);
}

TEST(Builders, NameTheArgumentTheyRefuse) {
  const Real nan = std::numeric_limits<Real>::quiet_NaN(), infinity = std::numeric_limits<Real>::infinity();
  EXPECT_EQ(invalid_argument([&] { make_box({1, -1, 1}, {1, 1, 1}); }),
            "make_box: size.y is -1, not a positive finite length");
  EXPECT_EQ(invalid_argument([&] { make_box({nan, 1, 1}, {1, 1, 1}); }),
            "make_box: size.x is nan, not a positive finite length");
  EXPECT_EQ(invalid_argument([&] { make_box({1, 1, 1}, {1, 1, 0}); }),
            "make_box: cells.z is 0, not between 1 and 100000000");
  EXPECT_EQ(invalid_argument([&] { make_box({1, 1, 1}, {100000, 100000, 1}); }),
            "make_box: cells are more than 100000000 together");
  EXPECT_EQ(invalid_argument([&] { make_box({1, 1, 1e-9}, {1, 1, 1}); }).substr(0, 40),
            "make_box(1, 1, 1e-09, 1, 1, 1): tetrahed");
  EXPECT_EQ(invalid_argument([&] { make_beam(0); }), "make_beam: cells_across is 0, not between 1 and 200");
  EXPECT_EQ(invalid_argument([&] { make_ball(0, 1); }), "make_ball: radius is 0, not a positive finite length");
  EXPECT_EQ(invalid_argument([&] { make_ball(1, 101); }), "make_ball: layers is 101, not between 1 and 100");
  EXPECT_EQ(invalid_argument([&] { make_torus(infinity); }),
            "make_torus: major_radius is inf, not a positive finite length");
  EXPECT_EQ(invalid_argument([&] { make_torus(0.3, 0.3); }),
            "make_torus: minor_radius is 0.3, not below major_radius 0.3");
  EXPECT_EQ(invalid_argument([&] { make_torus(0.7, 0.3, 3, 2); }),
            "make_torus: segments is 2, not between 3 and 100000");
  EXPECT_EQ(invalid_argument([&] { make_torus(0.7, 0.3, 200, 100000); }),
            "make_torus: layers 200 and segments 100000 give more than 10^8 tetrahedra");
}

}  // namespace
}  // namespace penalty::testing
