#include "files.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

class ReadTetgen : public MeshFiles {
 protected:
  TetMesh read(const std::string& node, const std::string& ele, const std::string& name = "a") const {
    write("a.node", node);
    write("a.ele", ele);
    return read_mesh(folder() / name);
  }
  std::string complaint(const std::string& node, const std::string& ele) const {
    return mesh_error([&] { read(node, ele); });
  }
};

TEST_F(ReadTetgen, TakesEitherFileOrTheStem) {
  for (const char* name : {"a", "a.node", "a.ele"}) expect_two_tetrahedra(read(tetgen_node, tetgen_ele, name));
}

TEST_F(ReadTetgen, CountsFromZeroToo) {
  expect_two_tetrahedra(
      read("5 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n4 0 0 -1\n", "2 4 0\n0 0 1 2 3\n1 0 2 1 4\n"));
}

TEST_F(ReadTetgen, KeepsRegionsAndMarkers) {
  const TetMesh mesh = read(tetgen_node, tetgen_ele);
  EXPECT_EQ(to_text(mesh.regions), "region 1: 0; region 2: 1");
  EXPECT_EQ(to_text(mesh.vertex_sets), "marker 1: 1");
  const TetMesh other = read(replaced(tetgen_node, "5  0 0 -1 7.5 0", "5, 0, 0, -1, 7.5, -3"),
                             "2 10 1\n1 1 2 3 4 5 5 5 5 5 5 2.5\n2 1 3 2 5 4 4 4 4 4 4 2.5\n");
  EXPECT_EQ(to_text(other.regions), "region 2.5: 0 1");
  EXPECT_EQ(to_text(other.vertex_sets), "marker 1: 1; marker -3: 4");
  EXPECT_EQ(to_text(read(tetgen_node, replaced(tetgen_ele, "2 4 1", "2 4 0")).regions), "");  // as the heading says
}

TEST_F(ReadTetgen, TakesCornersOfTenNodeTetrahedra) {
  expect_two_tetrahedra(read(tetgen_node, "2 10 0\n1 1 2 3 4 5 5 5 5 5 5\n2 1 3 2 5 4 4 4 4 4 4\n"));
}

TEST_F(ReadTetgen, NamesFileLineElementAndValue) {
  EXPECT_EQ(complaint(replaced(tetgen_node, "5  0 0 -1", "5  0 0 nan"), tetgen_ele),
            "a.node:8: vertex 5: coordinate z is nan");
  EXPECT_EQ(complaint(replaced(tetgen_node, "5  0 0 -1", "5  0 zero -1"), tetgen_ele),
            "a.node:8: vertex 5: coordinate y is 'zero', not a number");
  EXPECT_EQ(complaint(replaced(tetgen_node, "5  0 0 -1", "4  0 0 -1"), tetgen_ele),
            "a.node:8: vertex 4: the number was given before, in line 7");
  EXPECT_EQ(complaint(tetgen_node, replaced(tetgen_ele, "1 3 2 5", "1 3 2 6")),
            "a.ele:3: tetrahedron 2: there is no vertex 6");
  EXPECT_EQ(complaint(tetgen_node, replaced(tetgen_ele, "1 3 2 5", "1 3 2 1")),
            "a.ele:3: tetrahedron 2: vertex 1 is used twice");
  EXPECT_EQ(complaint(replaced(tetgen_node, "0 0 -1", "1 1 0"), tetgen_ele),
            "a.ele:3: tetrahedron 2: flat: volume 0 at a longest edge of 1.41421");
}

TEST_F(ReadTetgen, NamesBrokenStructure) {
  EXPECT_EQ(complaint(replaced(tetgen_node, "5 3 1 1", "5 2 1 1"), tetgen_ele), "a.node:2: the dimension is 2, not 3");
  EXPECT_EQ(complaint(replaced(tetgen_node, "5 3 1 1", "6 3 1 1"), tetgen_ele),
            "a.node:10: point 5: the file ends where the number of the point should stand");
  EXPECT_EQ(complaint(replaced(tetgen_node, "5 3 1 1", "4 3 1 1"), tetgen_ele),
            "a.node:8: found '5' after the last element");
  EXPECT_EQ(complaint(tetgen_node, replaced(tetgen_ele, "2 4 1", "2 8 1")),
            "a.ele:1: the number of nodes of a tetrahedron is 8, not 4 or 10");
  EXPECT_EQ(complaint(tetgen_node, replaced(tetgen_ele, "2 4 1", "-2 4 1")),
            "a.ele:1: the number of tetrahedra is -2, below zero");
}

TEST_F(ReadTetgen, NamesTheFileThatIsMissing) {
  write("only.node", tetgen_node);
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "only.node"); }), "only.ele: no such file");
  write("other.ele", tetgen_ele);
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "other.ele"); }), "other.node: no such file");
}

}  // namespace
}  // namespace penalty::testing
