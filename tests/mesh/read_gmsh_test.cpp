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

TEST_F(ReadGmsh, TakesEveryVersionAsTextAndInEitherByteOrder) {
  for (const char* version : {"1", "2.2", "4", "4.1"})
    for (const GmshNumbers numbers : {GmshNumbers::text, GmshNumbers::binary, GmshNumbers::swapped}) {
      if (version[0] == '1' && numbers != GmshNumbers::text) continue;  // there are none
      SCOPED_TRACE(std::string(version) + (numbers == GmshNumbers::text ? "" : " binary"));
      const std::string file = gmsh_file(version, numbers);
      expect_two_tetrahedra(read(file));
      for (std::size_t size = 0; size + 1 < file.size(); ++size) EXPECT_NE(complaint(file.substr(0, size)), "") << size;
    }
}

TEST_F(ReadGmsh, KeepsPhysicalGroupsAndTheirNames) {
  for (const char* version : {"1", "2.2", "4", "4.1"})
    for (const GmshNumbers numbers : {GmshNumbers::text, GmshNumbers::binary, GmshNumbers::swapped}) {
      if (version[0] == '1' && numbers != GmshNumbers::text) continue;
      SCOPED_TRACE(std::string(version) + (numbers == GmshNumbers::text ? "" : " binary"));
      const TetMesh mesh = read(gmsh_file(version, numbers));
      EXPECT_EQ(to_text(mesh.regions), version[0] == '1'   ? "physical 6: 0 1"
                                       : version[0] == '2' ? "rubber: 0 1"
                                                           : "rubber: 0 1; all of it: 0 1");
      EXPECT_EQ(to_text(mesh.vertex_sets), version[0] == '1'   ? "physical 5: 0 1 2 3 4"
                                           : version[0] == '2' ? "physical 5: 0 3 4; left side: 0 1 2"
                                                               : "left side: 0 1 2");
    }
}

TEST_F(ReadGmsh, KeepsVolumesOfTheModelWhereThereAreNoPhysicalGroups) {
  const std::string without = replaced(replaced(gmsh_2, "2 4 2 1 1", "2 4 2 0 1"), "3 4 2 1 1", "3 4 2 0 1");
  EXPECT_EQ(to_text(read(without).regions), "");
  EXPECT_EQ(to_text(read(replaced(without, "3 4 2 0 1", "3 4 2 0 9")).regions), "volume 1: 0; volume 9: 1");
  EXPECT_EQ(to_text(read(replaced(without, "3 4 2 0 1", "3 4 2 1 9")).regions), "body: 1");
}

TEST_F(ReadGmsh, PutsTheSolidsOfAnElementIntoItsGroup) {  // six tetrahedra a hexahedron at most
  const TetMesh mesh = read(gmsh_prisms);
  EXPECT_EQ(to_text(mesh.regions), "");
  const TetMesh grouped = read(replaced(replaced(gmsh_prisms, "1 6 0 ", "1 6 1 3 "), "2 6 0 ", "2 6 1 -4 "));
  EXPECT_EQ(to_text(grouped.regions), "physical 3: 0 1 2; physical 4: 3 4 5");
}

TEST_F(ReadGmsh, NamesAnEntityOfTooManyGroups) {
  std::string groups = "101";
  for (int k = 0; k < 101; ++k) groups += " 1";
  EXPECT_EQ(complaint(replaced(gmsh_41, "1 1 1 0 0\n", "1 1 1 " + groups + " 0\n")),
            "a.msh:6: entity 0: it is in 101 physical groups, more than 100");
}

TEST_F(ReadGmsh, TakesLineEndsOfOtherSystemsAndByteOrderMarks) {
  for (const char* line_end : {"\r\n", "\r"}) {
    std::string text = "\xef\xbb\xbf";
    for (const char c : gmsh_41) text += c == '\n' ? std::string(line_end) : std::string(1, c);
    expect_two_tetrahedra(read(text));
    EXPECT_EQ(complaint(replaced(text, "3 1 3 2 9", "3 1 3 2 10")), "a.msh:29: tetrahedron 3: there is no vertex 10");
  }
}

TEST_F(ReadGmsh, TakesNumbersOfFortran) {
  expect_two_tetrahedra(read(replaced(gmsh_2, "7 0 0 -1", "7 0.0D+00 0d0 -10.0D-01")));
}

TEST_F(ReadGmsh, TakesCommentsFirst) { expect_two_tetrahedra(read("$Comments\nby hand\n$EndComments\n" + gmsh_2)); }

TEST_F(ReadGmsh, TakesCornersOfSecondOrderTetrahedra) {
  const std::string text = replaced(gmsh_2, "2 4 2 1 1 10 30 20 1000000", "2 11 2 1 1 10 30 20 1000000 7 7 7 7 7 7");
  expect_two_tetrahedra(read(text));
  EXPECT_EQ(read(text).repairs.reduced_solids, 1);
}

TEST_F(ReadGmsh, TakesElementsThatStandInSeveralGroupsOnce) {
  const std::string text = replaced(replaced(gmsh_2, "\n3\n1 2 2", "\n4\n1 2 2"), "3 4 2 1 1 10 20 30 7",
                                    "3 4 2 1 1 10 20 30 7\n3 4 2 2 1 10 20 30 7");
  expect_two_tetrahedra(read(text));
  EXPECT_EQ(to_text(read(text).regions), "body: 0 1; physical 2: 1");
  EXPECT_EQ(to_text(read(text).repairs), "dropped 1 doubled or flat tetrahedron");
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
            "a.msh:21: element 3: a corner is '$EndElements', not an integer");
  EXPECT_EQ(complaint(replaced(gmsh_2, "3 4 2", "3 120 2")),
            "a.msh:20: element 3: element type 120 is not read: save the mesh with elements of first order");
  EXPECT_EQ(complaint(replaced(gmsh_41, "0 0 -1\n", "0 0 nan\n")), "a.msh:21: vertex 9: coordinate z is nan");
  EXPECT_EQ(complaint(replaced(gmsh_41, "3 1 3 2 9", "3 1 3 2 10")), "a.msh:29: tetrahedron 3: there is no vertex 10");
  EXPECT_EQ(complaint(replaced(replaced(gmsh_2, "2 4 2", "2 3 2"), "3 4 2", "3 3 2")),
            "a.msh: no solids, only points, lines and faces (3): fill them with tetrahedra (TetGen), or give a closed "
            "surface as .obj, .ply or .stl");
}

TEST_F(ReadGmsh, NamesBrokenStructure) {
  EXPECT_EQ(complaint("$NOD\n"), "a.msh:2: the file ends where the number of nodes should stand");
  EXPECT_EQ(complaint("# a mesh\n"), "a.msh:1: found '#' where a section should begin");
  EXPECT_EQ(complaint(gmsh_2.substr(gmsh_2.find("$Nodes"))),
            "a.msh:1: found '$Nodes' before $MeshFormat, which says how to read it");
  EXPECT_EQ(complaint(replaced(gmsh_41, "4.1", "5")),
            "a.msh:2: version '5' is none of 1, 2.x, 4.0 and 4.1: write another with gmsh -save -format msh41");
  EXPECT_EQ(complaint(replaced(gmsh_2, "2.2 0", "2.2 2")), "a.msh:2: the file type is 2, not 0 (ASCII) or 1 (binary)");
  EXPECT_EQ(complaint(replaced(gmsh_2, "2.2 0", "2.2 1")),
            "a.msh:3: the byte order is 1684948260, not 1 in either order");
  EXPECT_EQ(complaint(replaced(gmsh_2, "$EndNodes", "$EndNode")),
            "a.msh:15: found '$EndNode' where $EndNodes should stand");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$Elements"))), "a.msh:16: the section $Elements is missing");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$Nodes"))), "a.msh:8: the section $Nodes is missing");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("$EndPhysical"))),
            "a.msh:7: the file ends where $EndPhysicalNames should stand");
  EXPECT_EQ(complaint(gmsh_2.substr(0, gmsh_2.find("3 4 2"))),
            "a.msh:20: element 2: the file ends where the number of the element should stand");
}

}  // namespace
}  // namespace penalty::testing
