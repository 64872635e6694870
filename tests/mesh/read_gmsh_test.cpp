#include "files.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

class ReadGmsh : public MeshFiles {
 protected:
  TetMesh read(const std::string& contents) const { return read_mesh(write("a.msh", contents)); }
  std::string complaint(const std::string& contents) const {
    return mesh_error([&] { read(contents); });
  }
};

TEST_F(ReadGmsh, TakesVersion2WithSparseUnorderedNumbers) { expect_two_tetrahedra(read(gmsh_2)); }

TEST_F(ReadGmsh, TakesVersion41WithParametersAndBlocks) { expect_two_tetrahedra(read(gmsh_41)); }

TEST_F(ReadGmsh, TakesCornersOfSecondOrderTetrahedra) {
  const std::string text = replaced(gmsh_2, "2 4 2 1 1 10 30 20 1000000", "2 11 2 1 1 10 30 20 1000000 7 7 7 7 7 7");
  expect_two_tetrahedra(read(text));
}

TEST_F(ReadGmsh, TakesElementsBeforeNodes) {
  const auto nodes = gmsh_2.find("$Nodes"), elements = gmsh_2.find("$Elements");
  expect_two_tetrahedra(
      read(gmsh_2.substr(0, nodes) + gmsh_2.substr(elements) + gmsh_2.substr(nodes, elements - nodes)));
}

TEST_F(ReadGmsh, NamesFileLineElementAndValue) {
  EXPECT_EQ(complaint(replaced(gmsh_2, "7 0 0 -1", "7 0 inf -1")), "a.msh:14: vertex 7: coordinate y is inf");
  EXPECT_EQ(complaint(replaced(gmsh_2, "7 0 0 -1", "7 0 0 -1x")),
            "a.msh:14: vertex 7: coordinate z is '-1x', not a number");
  EXPECT_EQ(complaint(replaced(gmsh_2, "7 0 0 -1", "30 0 0 -1")),
            "a.msh:14: vertex 30: the number was given before, in line 11");
  EXPECT_EQ(complaint(replaced(gmsh_2, "10 20 30 7", "10 20 30 8")), "a.msh:20: tetrahedron 3: there is no vertex 8");
  EXPECT_EQ(complaint(replaced(gmsh_2, "10 20 30 7", "10 20 30 20")),
            "a.msh:20: tetrahedron 3: vertex 20 is used twice");
  EXPECT_EQ(complaint(replaced(gmsh_2, "3 4 2", "3 5 2")),
            "a.msh:20: element 3: element type 5 (hexahedron) is not a tetrahedron");
  EXPECT_EQ(complaint(replaced(gmsh_41, "0 0 -1\n", "0 0 nan\n")), "a.msh:21: vertex 9: coordinate z is nan");
  EXPECT_EQ(complaint(replaced(gmsh_41, "3 1 3 2 9", "3 1 3 2 10")), "a.msh:29: tetrahedron 3: there is no vertex 10");
  EXPECT_EQ(complaint(replaced(gmsh_41, "3 1 4 2", "3 1 6 2")),
            "a.msh:27: element block 1: element type 6 (prism) is not a tetrahedron");
}

TEST_F(ReadGmsh, NamesBrokenStructure) {
  EXPECT_EQ(complaint("$NOD\n"), "a.msh:1: not a Gmsh mesh of version 2 or 4: $MeshFormat is missing");
  EXPECT_EQ(complaint(replaced(gmsh_41, "4.1", "4")), "a.msh:2: version '4' is neither 2.x nor 4.1");
  EXPECT_EQ(complaint(replaced(gmsh_2, "2.2 0", "2.2 1")), "a.msh:2: binary Gmsh files are not read: save it as ASCII");
  EXPECT_EQ(complaint(replaced(gmsh_2, "$EndNodes", "$EndNode")),
            "a.msh:15: found '$EndNode' where $EndNodes should stand");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$Elements"))), "a.msh:16: the section $Elements is missing");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$Nodes"))), "a.msh:8: the section $Nodes is missing");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$EndPhysical"))),
            "a.msh:7: the file ends within the section '$PhysicalNames'");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("3 4 2"))),
            "a.msh:20: element 2: the file ends where the number of the element should stand");
}

}  // namespace
}  // namespace penalty::testing
