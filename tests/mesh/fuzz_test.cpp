// Broken files of every kind end in a usable mesh or in one line of complaint.
#include <functional>
#include <random>

#include "files.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

struct Sample {
  std::string name;  // of the file that is broken
  std::string contents;
  std::string partner_name = {}, partner = {};
};

std::vector<Sample> samples() {
  return {{"ascii.vtk", vtk_ascii},
          {"offsets.vtk", vtk_offsets},
          {"binary.vtk", vtk_binary()},
          {"binary_offsets.vtk", vtk_binary_offsets()},
          {"two.msh", gmsh_2},
          {"four.msh", gmsh_41},
          {"points.node", tetgen_node, "points.ele", tetgen_ele},
          {"cells.ele", tetgen_ele, "cells.node", tetgen_node}};
}

class BrokenFiles : public MeshFiles {
 protected:
  // True if the file gave a mesh. Memory errors are for the sanitizers to find.
  bool read(const std::string& name, const std::string& contents) const {
    const std::filesystem::path path = write(name, contents);
    try {
      const TetMesh mesh = read_mesh(path);
      EXPECT_FALSE(mesh.tetrahedra.empty());
      EXPECT_TRUE(mesh.vertices.allFinite());
      for (const Tetrahedron& t : mesh.tetrahedra)
        for (int v : t) EXPECT_TRUE(v >= 0 && v < mesh.vertices.cols());
      for (Real v : signed_volumes(mesh.vertices, mesh.tetrahedra)) EXPECT_GT(v, 0);
      return true;
    } catch (const MeshError& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find(folder().string()), 0u) << text;
      EXPECT_EQ(text.find_first_of("\r\n"), text.npos) << text;
      return false;
    }
  }
};

TEST_F(BrokenFiles, TruncatedAnywhereGiveAMeshOrAComplaint) {
  for (const Sample& sample : samples()) {
    if (!sample.partner_name.empty()) write(sample.partner_name, sample.partner);
    ASSERT_TRUE(read(sample.name, sample.contents)) << sample.name;
    int meshes = 0;
    for (std::size_t length = 0; length < sample.contents.size(); ++length)
      meshes += read(sample.name, sample.contents.substr(0, length));
    EXPECT_LT(meshes, 65) << sample.name << ": only what follows the last element may be missing";
  }
}

TEST_F(BrokenFiles, WithFlippedBytesGiveAMeshOrAComplaint) {
  constexpr unsigned seed = 20240607;
  std::mt19937 random(seed);
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const Sample& sample : samples()) {
    if (!sample.partner_name.empty()) write(sample.partner_name, sample.partner);
    int meshes = 0;
    for (int round = 0; round < 1000; ++round) {
      std::string contents = sample.contents;
      for (auto flips = 1 + random() % 3; flips > 0; --flips) {
        // Half of the changes write a digit: text that still parses goes deeper.
        char& byte = contents[random() % contents.size()];
        byte = static_cast<char>(random() % 2 == 0 ? random() % 256 : '0' + random() % 10);
      }
      meshes += read(sample.name, contents);
    }
    EXPECT_GT(meshes, 10) << sample.name << ": every change was refused, so nothing deep was tried";
    EXPECT_LT(meshes, 990) << sample.name << ": hardly a change was noticed";
  }
}

TEST_F(BrokenFiles, WithTrailingGarbageGiveAMeshOrAComplaint) {
  for (const Sample& sample : samples()) {
    if (!sample.partner_name.empty()) write(sample.partner_name, sample.partner);
    for (const std::string& garbage : {std::string("\0\0\0", 3), std::string(5000, '\xff'), std::string("POINTS 7")})
      read(sample.name, sample.contents + garbage);
  }
}

}  // namespace
}  // namespace penalty::testing
