#include "penalty/mesh/read_mesh.h"

#include <sys/resource.h>

#include <chrono>
#include <clocale>

#include "files.h"

namespace penalty::testing {
namespace {

class ReadMesh : public MeshFiles {};

TEST_F(ReadMesh, KnowsItsFilesByName) {
  for (const char* name : {"a.vtk", "b/a.VTK", "a.vtu", "a.msh", "a.node", "a.ele"})
    EXPECT_TRUE(is_tetrahedral_mesh_file(name)) << name;
  for (const char* name : {"a.obj", "a.stl", "a.ply", "a", "", ".vtk.", "vtk"})
    EXPECT_FALSE(is_tetrahedral_mesh_file(name)) << name;
  write("stem.node", tetgen_node);
  EXPECT_FALSE(is_tetrahedral_mesh_file(folder() / "stem"));
  write("stem.ele", tetgen_ele);
  EXPECT_TRUE(is_tetrahedral_mesh_file(folder() / "stem"));
}

TEST_F(ReadMesh, NamesWhatIsNoMeshFile) {
  std::filesystem::create_directories(folder() / "folder.vtk");
  for (const char* name : {"empty.vtk", "empty.msh", "empty.node", "some.xyz"}) write(name, "");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "none.vtk"); }), "none.vtk: no such file");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "none"); }), "none: no such file");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "folder.vtk"); }), "folder.vtk: is a directory, not a mesh file");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "empty.vtk"); }), "empty.vtk: the file is empty");
  for (const char* file : {"mark.vtk", "mark.msh", "mark.node"}) {
    write(file, "\xef\xbb\xbf");
    EXPECT_EQ(mesh_error([&] { read_mesh(folder() / file); }),
              std::string(file) + ": the file is empty but for a byte order mark");
  }
  write("pointer.msh", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "pointer.msh"); }),
            "pointer.msh: a pointer of Git LFS, not the file: `git lfs pull` fetches that");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "empty.msh"); }), "empty.msh: the file is empty");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "empty.node"); }), "empty.node: the file is empty");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "some.xyz"); }),
            "some.xyz: the extension '.xyz' is none of .vtk, .vtu, .msh, .node, .ele");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder()); }),
            folder().filename().string() + ": is a directory, not a mesh file");
  std::filesystem::create_symlink("/dev/zero", folder() / "endless.vtk");
  EXPECT_EQ(mesh_error([&] { read_mesh(folder() / "endless.vtk"); }), "endless.vtk: is not a regular file");
}

long peak_memory_kib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// Each claims some gigabytes in a few hundred bytes.
TEST_F(ReadMesh, ClaimsBeyondTheFileCostNothing) {
  const std::pair<std::string, std::string> files[] = {
      {"points.vtk", replaced(vtk_ascii, "POINTS 5", "POINTS 1000000000")},
      {"huge.vtk", replaced(vtk_ascii, "POINTS 5", "POINTS 9223372036854775807")},
      {"cells.vtk", replaced(vtk_ascii, "CELLS 3 14", "CELLS 1000000000 5000000000")},
      {"list.vtk", replaced(vtk_ascii, "CELLS 3 14", "CELLS 3 1000000000")},
      {"types.vtk", replaced(vtk_ascii, "CELL_TYPES 3", "CELL_TYPES 1000000000")},
      {"offsets.vtk", replaced(vtk_offsets, "CELLS 4 11", "CELLS 1000000000 11")},
      {"corners.vtk", replaced(vtk_offsets, "CELLS 4 11", "CELLS 4 1000000000")},
      {"field.vtk", replaced(vtk_offsets, "TIME 1 1", "TIME 100 1000000000")},
      {"raw_points.vtk", replaced(vtk_binary(), "POINTS 5", "POINTS 1000000000")},
      {"raw_cells.vtk", replaced(vtk_binary(), "CELLS 2 10", "CELLS 2 1000000000")},
      {"raw_offsets.vtk", replaced(vtk_binary_offsets(), "CELLS 3 8", "CELLS 1000000000 8")},
      {"raw_corners.vtk", replaced(vtk_binary_offsets(), "CELLS 3 8", "CELLS 3 1000000000")},
      {"nodes.msh", replaced(gmsh_2, "$Nodes\n5", "$Nodes\n1000000000")},
      {"elements.msh", replaced(gmsh_2, "$Elements\n3", "$Elements\n1000000000")},
      {"tags.msh", replaced(gmsh_2, "2 4 2 1", "2 4 1000000000 1")},
      {"blocks.msh", replaced(gmsh_41, "2 1 1 3\n", "2 1 1 1000000000\n")},
      {"block_elements.msh", replaced(gmsh_41, "3 1 4 2\n", "3 1 4 1000000000\n")},
      {"points.node", replaced(tetgen_node, "5 3 1 1", "1000000000 3 1 1")},
  };
  const long memory = peak_memory_kib();
  const auto start = std::chrono::steady_clock::now();
  for (const auto& file : files) {
    const std::string& name = file.first;
    const std::string complaint = mesh_error([&] { read_mesh(write(name, file.second)); });
    EXPECT_EQ(complaint.substr(0, name.size()), name) << complaint;
    EXPECT_EQ(complaint.find('\n'), complaint.npos) << complaint;
  }
  EXPECT_LT(peak_memory_kib() - memory, 20'000);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST_F(ReadMesh, ReadsTheSameInALocaleWithDecimalCommas) {
  // C++ streams follow the global C++ locale; a facet needs no installed locale.
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  const TetMesh mesh = read_mesh(write("a.vtk", replaced(vtk_ascii, "1 0 0", "1.25 0 0")));
  const std::string complaint =
      mesh_error([&] { read_mesh(write("b.vtk", replaced(vtk_ascii, "CELLS 3 14", "CELLS 3000 14"))); });
  std::locale::global(before);
  EXPECT_EQ(mesh.vertices(0, 1), 1.25);
  EXPECT_NE(complaint.find(" 3000"), complaint.npos) << complaint;
}

}  // namespace
}  // namespace penalty::testing
