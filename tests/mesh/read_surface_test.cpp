#include "penalty/mesh/read_surface.h"

#include "files.h"
#include "surface_files.h"
#include "surfaces.h"

namespace penalty::testing {
namespace {

class ReadSurface : public MeshFiles {
 protected:
  std::string complaint(const std::string& name, const std::string& contents) const {
    return mesh_error([&] { read_surface(write(name, contents)); });
  }
};

TEST_F(ReadSurface, KnowsItsFilesByName) {
  for (const char* name : {"a.obj", "b/a.STL", "a.ply"}) EXPECT_TRUE(is_surface_file(name)) << name;
  for (const char* name : {"a.vtk", "a", "", "obj", "a.obj.gz"}) EXPECT_FALSE(is_surface_file(name)) << name;
}

TEST_F(ReadSurface, TakesObjAndAllKindsOfPlyAndStl) {
  for (const auto& [name, contents] :
       {std::pair{"a.obj", obj}, std::pair{"a.ply", ply}, std::pair{"little.ply", ply_binary(false)},
        std::pair{"big.ply", ply_binary(true)}, std::pair{"a.stl", stl_ascii()}}) {
    const TriangleSurface surface = read_surface(write(name, contents));
    EXPECT_EQ(surface.vertices.cols(), 4) << name;
    EXPECT_EQ(surface.triangles.size(), 4u) << name;
    EXPECT_NEAR(volume(surface), 1.0 / 6, 1e-15) << name;
    EXPECT_FALSE(surface.repairs.flipped) << name;
    EXPECT_EQ(surface.source, (folder() / name).string());
  }
  const TriangleSurface box = read_surface(write("b.stl", stl_binary()));
  EXPECT_EQ(box.vertices.cols(), 8);
  EXPECT_NEAR(volume(box), 1, 1e-15);
}

TEST_F(ReadSurface, CutsLargerPolygons) {
  const TriangleSurface cube =
      read_surface(write("a.obj",
                         "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                         "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"));
  EXPECT_EQ(cube.triangles.size(), 12u);
  EXPECT_NEAR(volume(cube), 1, 1e-15);
}

TEST_F(ReadSurface, TakesOpenOnes) {
  const TriangleSurface open = read_surface(write("a.obj", replaced(obj, "f 2 3 4\n", "")));
  EXPECT_EQ(open.triangles.size(), 3u);
  EXPECT_EQ(topology_of(open).open_edges, 3);
  EXPECT_NE(
      invalid_argument([&] { check_closed(open); }).find("a.obj: the surface is open: the edge from vertex (0, 1, 0)"),
      std::string::npos);
}

TEST_F(ReadSurface, NamesFileAndFault) {
  EXPECT_EQ(mesh_error([&] { read_surface(folder() / "none.obj"); }), "none.obj: no such file");
  std::filesystem::create_directories(folder() / "folder.obj");
  EXPECT_EQ(mesh_error([&] { read_surface(folder() / "folder.obj"); }), "folder.obj: is a directory, not a mesh file");
  EXPECT_EQ(complaint("a.obj", ""), "a.obj: the file is empty");
  EXPECT_EQ(complaint("a.off", "OFF\n"), "a.off: the extension '.off' is none of .obj, .stl, .ply");
  EXPECT_EQ(complaint("a.obj", replaced(obj, "v 0 0 1", "v 0 nan 1")), "a.obj: vertex 5: coordinate y is nan");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "vertex 4", "vertex 1000000000")),
            "a.ply:3: the number of elements is 1000000000, more than the rest of the file can hold");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "0 1 0\n", "0 one 0\n")), "a.ply:12: vertex 2: y is 'one', not a number");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "3 1 2 3", "3 1 2 4")),
            "a.ply: triangle 3: vertex index 4 is outside 0 to 3");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "3 1 2 3", "3 1 2 -1")),
            "a.ply:17: face 3: vertex index -1 is out of range");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "property float z\n", "")), "a.ply:8: the vertices have no property z");
  EXPECT_EQ(complaint("a.ply", ply_binary(true).substr(0, ply_binary(true).size() - 1)).substr(0, 6), "a.ply:");
  EXPECT_EQ(complaint("a.ply", "what\n"), "a.ply:1: not a PLY file: it does not begin with 'ply'");
  for (const char* name : {"b.obj", "b.stl"}) {
    const std::string text = complaint(name, "what is this?\n");
    EXPECT_EQ(text.substr(0, 7), name + std::string(": ")) << text;
    EXPECT_EQ(text.find('\n'), text.npos);
  }
}

TEST_F(ReadSurface, NamesFromTheFileCannotDisturbAMessage) {
  const std::string escape = "ver\x1b[31mtex\xc3", endless(5000, 'n');
  EXPECT_EQ(complaint("a.ply", replaced(ply, "element vertex 4\n", "element " + escape + " 4\n")),
            "a.ply: triangle 0: vertex index 0 is outside 0 to -1");
  EXPECT_EQ(complaint("a.ply", replaced(replaced(ply, "element face", "element " + escape), "3 0 2 1", "3 0 x 1")),
            "a.ply:14: ver?[31mtex? 0: vertex_indices is 'x', not a number");
  EXPECT_EQ(complaint("a.ply", replaced(ply, "element face 4\n", "element " + endless + " 4\nelement face 4\n")),
            "a.ply:10: element '" + std::string(40, 'n') + "...' has no properties");
  EXPECT_EQ(
      complaint("a.ply", replaced(replaced(ply, "element face 4\n", "property float " + endless + "\nelement face 4\n"),
                                  "0 0 0\n", "0 0 0 what\n")),
      "a.ply:11: vertex 0: " + std::string(40, 'n') + "... is 'what', not a number");
}

TEST_F(ReadSurface, WhatAssimpQuotesCannotDisturbAMessage) {
  const std::string endless(5000, 'p');
  const std::string text = complaint("a.stl", replaced(stl_ascii(), "vertex 0 0 0", "vertex 0 0 \x1b\xc3" + endless));
  EXPECT_EQ(text.substr(0, 7), "a.stl: ");
  EXPECT_NE(text.find("ppp"), text.npos) << text;
  EXPECT_LT(text.size(), 220u) << text;
  for (char c : text) EXPECT_TRUE(c >= ' ' && c < '\x7f') << text;
}

TEST_F(ReadSurface, ABinaryStlThatClaimsTooManyTrianglesIsRefused) {
  std::string bytes = stl_binary();
  bytes.replace(80, 4, "\xff\xff\xff\x7f");
  EXPECT_EQ(complaint("a.stl", bytes).substr(0, 7), "a.stl: ");
}

}  // namespace
}  // namespace penalty::testing
