#include "penalty/mesh/read_surface.h"

#include <random>

#include "files.h"
#include "surfaces.h"

// Assimp loses memory when it gives up on a broken file; the leak checker is told that this is not ours.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier): the checker's name
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp\n"; }  // NOLINT

namespace penalty::testing {
namespace {

// A tetrahedron of volume 1/6.
const std::string obj = "# corner\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const std::string ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string stl_ascii() {
  const char* points[] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
  std::string text = "solid corner\n";
  for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{0, 3, 2}, Triangle{1, 2, 3}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (int v : t) text += std::string("vertex ") + points[v] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid corner\n";
}

std::string stl_binary() {
  const TriangleSurface box = soup(boundary_surface(make_box({1, 1, 1}, {1, 1, 1})));
  std::string bytes(80, ' ');
  const auto add = [&bytes](auto value) {
    std::string raw = big_endian(value);
    bytes.append(raw.rbegin(), raw.rend());  // STL is little-endian
  };
  add(static_cast<std::uint32_t>(box.triangles.size()));
  for (const Triangle& t : box.triangles) {
    for (int k = 0; k < 3; ++k) add(0.0f);
    for (int v : t)
      for (int axis = 0; axis < 3; ++axis) add(static_cast<float>(box.vertices(axis, v)));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::string ply_binary(bool big) {
  std::string text =
      replaced(ply.substr(0, ply.find("0 0 0\n")), "ascii", big ? "binary_big_endian" : "binary_little_endian");
  const auto add = [&](auto value) {
    const std::string raw = big_endian(value);
    big ? text.append(raw) : text.append(raw.rbegin(), raw.rend());
  };
  for (float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) add(x);
  for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{0, 3, 2}, Triangle{1, 2, 3}}) {
    text += '\3';
    for (int v : t) add(v);
  }
  return text;
}

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

TEST_F(ReadSurface, NamesFileAndFault) {
  EXPECT_EQ(mesh_error([&] { read_surface(folder() / "none.obj"); }), "none.obj: no such file");
  std::filesystem::create_directories(folder() / "folder.obj");
  EXPECT_EQ(mesh_error([&] { read_surface(folder() / "folder.obj"); }), "folder.obj: is a directory, not a mesh file");
  EXPECT_EQ(complaint("a.obj", ""), "a.obj: the file is empty");
  EXPECT_EQ(complaint("a.off", "OFF\n"), "a.off: the extension '.off' is none of .obj, .stl, .ply");
  EXPECT_EQ(
      complaint("a.obj", replaced(obj, "f 2 3 4\n", "")),
      "a.obj: the surface is open: the edge from vertex (0, 1, 0) to vertex (1, 0, 0) belongs to one triangle only");
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

TEST_F(ReadSurface, ABinaryStlThatClaimsTooManyTrianglesIsRefused) {
  std::string bytes = stl_binary();
  bytes.replace(80, 4, "\xff\xff\xff\x7f");
  EXPECT_EQ(complaint("a.stl", bytes).substr(0, 7), "a.stl: ");
}

TEST_F(ReadSurface, TruncatedAnywhereOrFlippedGivesASurfaceOrAComplaint) {
  constexpr unsigned seed = 5;
  std::mt19937 random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const auto& [name, contents] :
       {std::pair{"a.obj", obj}, std::pair{"a.ply", ply}, std::pair{"little.ply", ply_binary(false)},
        std::pair{"big.ply", ply_binary(true)}, std::pair{"a.stl", stl_ascii()}, std::pair{"b.stl", stl_binary()}}) {
    int surfaces = 0;
    for (std::size_t length = 0; length < contents.size(); ++length)
      surfaces += complaint(name, contents.substr(0, length)).empty();
    EXPECT_LT(surfaces, 40) << name << ": only the last closing words may be missing";
    for (int round = 0; round < 300; ++round) {
      std::string broken = contents;
      for (auto flips = 1 + random() % 3; flips > 0; --flips)
        broken[random() % broken.size()] = static_cast<char>(random() % 2 == 0 ? random() % 256 : '0' + random() % 10);
      const std::string text = complaint(name, broken);
      EXPECT_EQ(text.find('\n'), text.npos) << text;
    }
  }
}

}  // namespace
}  // namespace penalty::testing
