#include "penalty/mesh/tet_mesh.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "files.h"
#include "penalty/mesh/builders.h"

namespace penalty::testing {
namespace {

TEST(Repair, LeavesAGoodMeshAlone) {
  TetMesh mesh = two_tetrahedra();
  repair(mesh);
  expect_two_tetrahedra(mesh);
}

TEST(Repair, TurnsLeftHandedTetrahedra) {
  TetMesh mesh = two_tetrahedra();
  std::swap(mesh.tetrahedra[1][0], mesh.tetrahedra[1][1]);
  ASSERT_LT(signed_volumes(mesh.vertices, mesh.tetrahedra)[1], 0);
  repair(mesh);
  EXPECT_EQ(mesh.repairs.reoriented, 1);
  for (Real v : signed_volumes(mesh.vertices, mesh.tetrahedra)) EXPECT_DOUBLE_EQ(v, 1.0 / 6);
}

// Two rows of cubes, tetrahedra each, that meet in a plane without a common vertex.
TEST(Repair, MergesTheSeamOfAMeshFromAFile) {
  const TetMesh half = make_box({1, 1, 1}, {2, 2, 2});
  const Eigen::Index size = half.vertices.cols();
  TetMesh mesh = half;
  mesh.vertices.conservativeResize(3, 2 * size);
  mesh.vertices.rightCols(size) = half.vertices;
  mesh.vertices.rightCols(size).row(0) *= -1;
  for (Tetrahedron t : half.tetrahedra) {
    for (int& v : t) v += static_cast<int>(size);
    std::swap(t[0], t[1]);
    mesh.tetrahedra.push_back(t);
  }
  const Real lowest = half.vertices.row(0).minCoeff();
  mesh.vertices.row(0).head(size).array() -= lowest;
  mesh.vertices.row(0).tail(size).array() += lowest;
  repair(mesh, MeshOrigin{});
  EXPECT_EQ(to_text(mesh.repairs), "merged 9 vertices");
  EXPECT_EQ(mesh.vertices.cols(), 2 * size - 9);
  EXPECT_NEAR(volume(mesh), 2, 1e-14);
  EXPECT_EQ(boundary_faces(mesh.tetrahedra).size(), 2 * boundary_faces(half.tetrahedra).size() - 16);
}

TEST(Repair, DropsAFlatTetrahedronInAHundredOfAFile) {
  TetMesh mesh = make_box({1, 1, 1}, {3, 3, 3});
  const std::size_t whole = mesh.tetrahedra.size();
  ASSERT_GE(whole, 100u);
  const Tetrahedron flat{0, 1, 2, 3};  // in a row
  mesh.tetrahedra.insert(mesh.tetrahedra.begin() + 5, flat);
  TetMesh by_hand = mesh;
  EXPECT_THROW(repair(by_hand), std::invalid_argument);
  repair(mesh, MeshOrigin{});
  EXPECT_EQ(to_text(mesh.repairs), "dropped 1 doubled or flat tetrahedron");
  EXPECT_EQ(mesh.tetrahedra.size(), whole);
  EXPECT_NEAR(volume(mesh), 1, 1e-14);
}

TEST(Repair, DropsUnmentionedVerticesAndKeepsTheOrderOfTheRest) {
  TetMesh mesh = two_tetrahedra();
  const TetMesh expected = mesh;
  mesh.vertices.resize(3, 7);
  mesh.vertices << Vector3(9, 9, 9), expected.vertices.leftCols(2), Vector3(8, 8, 8), expected.vertices.rightCols(3);
  mesh.tetrahedra = {{1, 2, 4, 5}, {1, 4, 2, 6}};
  repair(mesh);
  EXPECT_EQ(mesh.repairs.dropped_vertices, 2);
  EXPECT_EQ(mesh.vertices, expected.vertices);
  EXPECT_EQ(mesh.tetrahedra, expected.tetrahedra);
}

TEST(Repair, NumbersGroupsAnew) {
  TetMesh mesh = two_tetrahedra();
  mesh.vertices.conservativeResize(Eigen::NoChange, 8);
  mesh.vertices.rightCols<3>() << 9, 0, 1,  //
      9, 0, 1,                              //
      9, 1, 1;
  // Vertex 6 stands where 3 does, 5 and 7 are in no tetrahedron; the first tetrahedron is there twice.
  mesh.tetrahedra = {{0, 1, 2, 6}, {0, 1, 2, 3}, {0, 2, 1, 4}};
  mesh.regions = {{"twice", {1}}, {"lower", {2, 2}}, {"none", {}}};
  mesh.vertex_sets = {{"merged", {6, 3, 0}}, {"lost", {5, 7}}, {"part", {7, 4}}};
  repair(mesh, MeshOrigin{});
  EXPECT_EQ(to_text(mesh.regions), "twice: 0; lower: 1");
  EXPECT_EQ(to_text(mesh.vertex_sets), "merged: 0 3; part: 4");
}

TEST(Repair, NamesMembersOfGroupsOutOfRange) {
  TetMesh mesh = two_tetrahedra();
  mesh.source = "b";
  mesh.regions = {{"soft", {0, 2}}};
  EXPECT_EQ(invalid_argument([&] { repair(mesh); }), "b: region 'soft': tetrahedron 2 is outside the 2 of the mesh");
  mesh.regions.clear();
  mesh.vertex_sets = {{"held", {-1}}};
  EXPECT_EQ(invalid_argument([&] { repair(mesh); }), "b: vertex set 'held': vertex -1 is outside the 5 of the mesh");
}

TEST(Repair, NamesWhatItRefuses) {
  const auto complaint = [](auto spoil) {
    TetMesh mesh = two_tetrahedra();
    mesh.source = "made";
    spoil(mesh);
    return invalid_argument([&] { repair(mesh); });
  };
  EXPECT_EQ(complaint([](TetMesh& m) { m.tetrahedra.clear(); }), "made: the mesh has no tetrahedra");
  EXPECT_EQ(complaint([](TetMesh& m) { m.vertices(1, 4) = std::nan(""); }), "made: vertex 4: coordinate y is nan");
  EXPECT_EQ(complaint([](TetMesh& m) { m.vertices(2, 0) = -std::numeric_limits<Real>::infinity(); }),
            "made: vertex 0: coordinate z is -inf");
  EXPECT_EQ(complaint([](TetMesh& m) { m.vertices(0, 1) = 1e101; }),
            "made: vertex 1: coordinate x is 1e+101, beyond 1e+100");
  EXPECT_EQ(complaint([](TetMesh& m) { m.tetrahedra[1][2] = 5; }),
            "made: tetrahedron 1: vertex index 5 is outside 0 to 4");
  EXPECT_EQ(complaint([](TetMesh& m) { m.tetrahedra[0][3] = -1; }),
            "made: tetrahedron 0: vertex index -1 is outside 0 to 4");
  EXPECT_EQ(complaint([](TetMesh& m) { m.tetrahedra[0][3] = 2; }), "made: tetrahedron 0: vertex 2 is used twice");
  EXPECT_EQ(complaint([](TetMesh& m) { m.tetrahedra[1] = {3, 0, 1, 2}; }),
            "made: tetrahedron 1: same four vertices as tetrahedron 0");
  EXPECT_EQ(complaint([](TetMesh& m) { m.vertices.col(4) << 2, 2, 0; }),
            "made: tetrahedron 1: flat: volume 0 at a longest edge of 2.82843");
  EXPECT_EQ(invalid_argument([] {
              TetMesh empty;
              repair(empty);
            }),
            "mesh: the mesh has no tetrahedra");
}

TEST(Repair, FlatnessIsRelativeToSize) {
  // 6 V / L^3 of a corner of height h at unit legs: h / 2^(3/2).
  for (Real scale : {1e-90, 1e-6, 1.0, 1e6, 1e90})
    for (Real height : {0.9e-6, 1.1e-6}) {
      TetMesh mesh = two_tetrahedra();
      mesh.vertices.row(2) *= height * std::pow(2, 1.5);
      mesh.vertices *= scale;
      const std::string complaint = invalid_argument([&] { repair(mesh); });
      EXPECT_EQ(complaint.empty(), height > 1e-6) << scale << " " << height << " " << complaint;
    }
}

TEST(Repair, RefusesVolumesThatUnderflow) {
  TetMesh mesh = two_tetrahedra();
  mesh.vertices *= 1e-110;
  EXPECT_NE(invalid_argument([&] { repair(mesh); }), "");
}

TEST(Quality, OfTheRegularTetrahedronMatchesClosedForm) {
  TetMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1, 1;
  mesh.tetrahedra = {{0, 1, 2, 3}};
  repair(mesh);
  const MeshQuality q = quality(mesh);
  EXPECT_NEAR(q.edge_ratio, 1, 1e-15);
  EXPECT_NEAR(q.smallest_dihedral, std::acos(1.0 / 3), 1e-15);
  EXPECT_NEAR(q.largest_dihedral, std::acos(1.0 / 3), 1e-15);
}

TEST(Quality, OfACubeCornerMatchesClosedForm) {
  const MeshQuality q = quality(two_tetrahedra());
  EXPECT_NEAR(q.edge_ratio, std::numbers::sqrt2, 1e-15);
  EXPECT_NEAR(q.smallest_dihedral, std::acos(1 / std::sqrt(3.0)), 1e-15);
  EXPECT_NEAR(q.largest_dihedral, std::numbers::pi / 2, 1e-15);
}

}  // namespace
}  // namespace penalty::testing
