#include "penalty/mesh/write_mesh.h"

#include <random>

#include "files.h"
#include "penalty/mesh/builders.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

class WriteVtk : public MeshFiles {};

TEST_F(WriteVtk, RoundTripIsExact) {
  constexpr unsigned seed = 7;
  std::mt19937 random(seed);
  std::uniform_real_distribution<Real> jitter(-0.1, 0.1);
  TetMesh mesh = make_box({1, 1, 1}, {3, 3, 3});
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) mesh.vertices.data()[i] += jitter(random) / 3;
  for (Real scale : {1.0, 1e-80, 1e80}) {
    TetMesh scaled = mesh;
    scaled.vertices *= scale;
    repair(scaled);
    write_vtk(folder() / "a.vtk", scaled);
    const TetMesh back = read_mesh(folder() / "a.vtk");
    EXPECT_EQ(back.vertices, scaled.vertices) << "seed " << seed;
    EXPECT_EQ(back.tetrahedra, scaled.tetrahedra);
    EXPECT_EQ(back.source, (folder() / "a.vtk").string());
  }
}

TEST_F(WriteVtk, ScalarsFollowTheMesh) {
  const TetMesh mesh = two_tetrahedra();
  const std::vector<Real> heat{1, 2, 3, 4, 0.1}, strain{-1, 1e-300};
  const MeshScalars at_vertices[] = {{"heat", heat}}, at_tetrahedra[] = {{"strain", strain}};
  write_vtk(folder() / "a.vtk", mesh, at_vertices, at_tetrahedra);
  std::ifstream stream(folder() / "a.vtk");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_NE(text.find("POINT_DATA 5\nSCALARS heat double 1\nLOOKUP_TABLE default\n1\n2\n3\n4\n0.1\n"
                      "CELL_DATA 2\nSCALARS strain double 1\nLOOKUP_TABLE default\n-1\n1"),
            text.npos)
      << text;
  expect_two_tetrahedra(read_mesh(folder() / "a.vtk"));
}

TEST_F(WriteVtk, ATitleOfSeveralLinesStaysOneLine) {
  TetMesh mesh = two_tetrahedra();
  mesh.source = "one\nPOINTS 7 double\n" + std::string(500, 'x');
  write_vtk(folder() / "a.vtk", mesh);
  expect_two_tetrahedra(read_mesh(folder() / "a.vtk"));
}

TEST_F(WriteVtk, NamesWhatItRefuses) {
  const TetMesh mesh = two_tetrahedra();
  const std::vector<Real> values(4, 1);
  const auto complaint = [&](const std::string& name, bool at_vertices) {
    const MeshScalars scalars[] = {{name, values}};
    return invalid_argument([&] {
      at_vertices ? write_vtk(folder() / "a.vtk", mesh, scalars) : write_vtk(folder() / "a.vtk", mesh, {}, scalars);
    });
  };
  EXPECT_EQ(complaint("heat", true), "write_vtk: heat has 4 values for 5 vertices");
  EXPECT_EQ(complaint("heat", false), "write_vtk: heat has 4 values for 2 tetrahedra");
  EXPECT_EQ(complaint("two words", true), "write_vtk: scalars need a name without white space, not 'two words'");
  EXPECT_EQ(mesh_error([&] { write_vtk(folder() / "none" / "a.vtk", mesh); }), "a.vtk: cannot be written");
}

}  // namespace
}  // namespace penalty::testing
