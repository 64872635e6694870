// Small mesh files, good and bad, written where a test may write.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "penalty/mesh/tet_mesh.h"

namespace penalty::testing {

/// A directory of its own for each test, removed at its end.
class MeshFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("penalty-") + info->test_suite_name() + "-" + info->name() + "-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder() const { return folder_; }
  std::filesystem::path write(const std::string& name, const std::string& contents) const {
    std::ofstream(folder_ / name, std::ios::binary) << contents;
    return folder_ / name;
  }

 private:
  std::filesystem::path folder_;
};

/// What `act` throws, without the folder of the file; "" if it throws nothing. Anything but a MeshError passes through.
template <class Act>
std::string mesh_error(const Act& act) {
  try {
    act();
  } catch (const MeshError& error) {
    const std::string text = error.what();
    const auto slash = text.rfind('/', text.find(": "));
    return slash == text.npos ? text : text.substr(slash + 1);
  }
  return "";
}

/// What `act` throws as std::invalid_argument; "" if it throws nothing.
template <class Act>
std::string invalid_argument(const Act& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == text.npos) throw std::logic_error("the test replaces what is not there: " + from);
  return text.replace(at, from.size(), to);
}

template <class T>
std::string big_endian(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if constexpr (std::endian::native == std::endian::little) bytes.assign(bytes.rbegin(), bytes.rend());
  return bytes;
}

// Every file below is the same mesh: two tetrahedra on the triangle (0, 1, 2), one to either side, of volume 1/6 each.
inline TetMesh two_tetrahedra() {
  TetMesh mesh;
  mesh.vertices.resize(3, 5);
  mesh.vertices << 0, 1, 0, 0, 0,  //
      0, 0, 1, 0, 0,               //
      0, 0, 0, 1, -1;
  mesh.tetrahedra = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  return mesh;
}

inline const std::string vtk_ascii =
    "# vtk DataFile Version 2.0\n"  // 1
    "two tetrahedra\n"              // 2
    "ASCII\n"                       // 3
    "DATASET UNSTRUCTURED_GRID\n"   // 4
    "POINTS 5 double\n"             // 5
    "0 0 0\n"                       // 6
    "1 0 0\n"                       // 7
    "0 1 0\n"                       // 8
    "0 0 1\n"                       // 9
    "0 0 -1\n"                      // 10
    "CELLS 3 14\n"                  // 11
    "4 0 1 2 3\n"                   // 12
    "3 0 1 2\n"                     // 13: a triangle between them
    "4 0 2 1 4\n"                   // 14
    "CELL_TYPES 3\n"                // 15
    "10\n5\n10\n";                  // 16, 17, 18

/// Numbers on the cells and the points of the same file: some group them.
inline const std::string vtk_data =
    "CELL_DATA 3\nSCALARS material%20id int 1\nLOOKUP_TABLE default\n4 2 -1\n"
    "FIELD FieldData 3\nheat 1 3 double\n1.5 2 3\nsame 1 3 float\n1 1 1\nsides 2 3 int\n1 2 3 4 5 6\n"
    "VECTORS flow float\n1 0 0 1 0 0 1 0 0\n"
    "POINT_DATA 5\nSCALARS fixed unsigned_char\nLOOKUP_TABLE default\n0 0 1 0 7\n"
    "SCALARS whole float\nLOOKUP_TABLE default\n1 1 1 2 0\n";

inline const std::string vtk_offsets =
    "# vtk DataFile Version 5.1\n"
    "two tetrahedra\n"
    "ASCII\n"
    "DATASET UNSTRUCTURED_GRID\n"
    "FIELD FieldData 1\n"
    "TIME 1 1 double\n"
    "0.5\n"
    "POINTS 5 float\n"
    "0 0 0 1 0 0 0 1 0\n"
    "0 0 1 0 0 -1\n"
    "METADATA\n"
    "INFORMATION 0\n"
    "\n"
    "CELLS 4 11\n"
    "OFFSETS vtktypeint64\n"
    "0 4 7 11\n"
    "CONNECTIVITY vtktypeint64\n"
    "0 1 2 3 0 1 2 0 2 1 4\n"
    "CELL_TYPES 3\n"
    "10 5 10\n"
    "CELL_DATA 3\n"
    "SCALARS heat double 1\n"
    "LOOKUP_TABLE default\n"
    "1 2 3\n";

inline std::string big_endian_points(bool as_float) {
  std::string bytes;
  const TetMesh mesh = two_tetrahedra();
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) {
    const double value = mesh.vertices.data()[i];
    bytes += as_float ? big_endian(static_cast<float>(value)) : big_endian(value);
  }
  return bytes;
}

inline std::string vtk_binary() {
  std::string text = "# vtk DataFile Version 4.2\nbinary\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n";
  text += big_endian_points(true) + "\nCELLS 2 10\n";
  for (int number : {4, 0, 1, 2, 3, 4, 0, 2, 1, 4}) text += big_endian(number);
  text += "\nCELL_TYPES 2\n" + big_endian(10) + big_endian(10) + "\n";
  return text;
}

inline std::string vtk_binary_offsets() {
  std::string text = "# vtk DataFile Version 5.1\nbinary\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n";
  text += big_endian_points(false) + "\nCELLS 3 8\nOFFSETS vtktypeint64\n";
  for (std::int64_t number : {0, 4, 8}) text += big_endian(number);
  text += "\nCONNECTIVITY vtktypeint64\n";
  for (std::int64_t number : {0, 1, 2, 3, 0, 2, 1, 4}) text += big_endian(number);
  text += "\nCELL_TYPES 2\n" + big_endian(10) + big_endian(10) + "\n";
  return text;
}

inline const std::string gmsh_2 =
    "$MeshFormat\n"                 // 1
    "2.2 0 8\n"                     // 2
    "$EndMeshFormat\n"              // 3
    "$PhysicalNames\n"              // 4
    "1\n"                           // 5
    "3 1 \"body\"\n"                // 6
    "$EndPhysicalNames\n"           // 7
    "$Nodes\n"                      // 8
    "5\n"                           // 9
    "10 0 0 0\n"                    // 10: numbers with gaps, not in order
    "30 1 0 0\n"                    // 11
    "20 0 1 0\n"                    // 12
    "1000000 0 0 1\n"               // 13
    "7 0 0 -1\n"                    // 14
    "$EndNodes\n"                   // 15
    "$Elements\n"                   // 16
    "3\n"                           // 17
    "1 2 2 0 1 10 30 20\n"          // 18: a triangle
    "2 4 2 1 1 10 30 20 1000000\n"  // 19
    "3 4 2 1 1 10 20 30 7\n"        // 20
    "$EndElements\n";               // 21

inline const std::string gmsh_41 =
    "$MeshFormat\n"         // 1
    "4.1 0 8\n"             // 2
    "$EndMeshFormat\n"      // 3
    "$Entities\n"           // 4
    "0 0 0 1\n"             // 5
    "1 0 0 -1 1 1 1 0 0\n"  // 6
    "$EndEntities\n"        // 7
    "$Nodes\n"              // 8
    "2 5 1 9\n"             // 9
    "2 1 1 3\n"             // 10: on a surface, with two parameters each
    "1\n2\n3\n"             // 11, 12, 13
    "0 0 0 0.5 0.5\n"       // 14
    "1 0 0 0.5 0.5\n"       // 15
    "0 1 0 0.5 0.5\n"       // 16
    "3 1 0 2\n"             // 17
    "8\n9\n"                // 18, 19
    "0 0 1\n"               // 20
    "0 0 -1\n"              // 21
    "$EndNodes\n"           // 22
    "$Elements\n"           // 23
    "2 3 1 3\n"             // 24
    "2 1 2 1\n"             // 25
    "1 1 2 3\n"             // 26
    "3 1 4 2\n"             // 27
    "2 1 2 3 8\n"           // 28
    "3 1 3 2 9\n"           // 29
    "$EndElements\n";       // 30

/// How numbers of a Gmsh file are written.
enum class GmshNumbers { text, binary, swapped };

/// The mesh, between a point, a triangle and a line that are none of it, in the layout of a Gmsh version: "1", "2.2",
/// "4", "4.1". Its nodes have the numbers 11 to 15. Tetrahedra are in the physical group 6, "rubber", and from version 4 on
/// in 8, "all of it", the triangle in 5, "left side"; until version 2 point and line are in a group 5 of their dimension.
inline std::string gmsh_file(const std::string& version, GmshNumbers numbers) {
  const bool is_text = numbers == GmshNumbers::text, is_old = version == "1", is_4 = version[0] == '4';
  const bool is_41 = version == "4.1";
  const bool is_little = (std::endian::native == std::endian::little) == (numbers == GmshNumbers::binary);
  std::string file;
  const auto put = [&](auto value) {
    if (is_text) {
      file += std::to_string(value) + " ";
    } else {
      std::string bytes = big_endian(value);
      if (is_little) bytes.assign(bytes.rbegin(), bytes.rend());
      file += bytes;
    }
  };
  const auto put_int = [&](int value) { put(std::int32_t{value}); };
  const auto put_size = [&](int value) { put(std::int64_t{value}); };
  const auto put_tag = [&](int value) { is_41 ? put_size(value) : put_int(value); };
  const auto end_line = [&] { file += is_text ? "\n" : ""; };
  const auto end_section = [&](const char* name) { file += std::string(is_text ? "" : "\n") + name + "\n"; };
  const TetMesh mesh = two_tetrahedra();
  struct Element {
    int type;
    std::vector<int> nodes;
  };
  const std::vector<Element> elements{
      {15, {11}}, {2, {11, 12, 13}}, {4, {11, 12, 13, 14}}, {4, {11, 13, 12, 15}}, {1, {14, 15}}};

  if (!is_old) {
    file = "$MeshFormat\n" + version + (is_text ? " 0 8\n" : " 1 8\n");
    if (!is_text) put_int(1), file += "\n";
    file +=
        "$EndMeshFormat\n$PhysicalNames\n3\n2 5 \"left side\"\n3 6 \"rubber\"\n3 8 \"all of it\"\n$EndPhysicalNames\n";
  }
  if (is_4) {  // a surface and a volume, both with the number 7
    file += "$Entities\n";
    for (const int count : {0, 0, 1, 1}) put_size(count);
    end_line();
    for (const bool is_volume : {false, true}) {
      put_int(7);
      for (const double side : {0, 0, -1, 1, 1, 1}) put(side);
      put_size(is_volume ? 2 : 1), put_int(is_volume ? 6 : 5);
      if (is_volume) put_int(-8);
      put_size(1), put_int(-7), end_line();
    }
    end_section("$EndEntities");
  }
  file += is_old ? "$NOD\n" : "$Nodes\n";
  const auto put_place = [&](int v) {
    for (int axis = 0; axis < 3; ++axis) put(mesh.vertices(axis, v));
  };
  if (is_4) {
    put_size(2), put_size(5);
    if (is_41) put_size(11), put_size(15);
    end_line();
    for (const int block : {0, 1}) {  // on a face, with two parameters each; in a volume
      const int dimension = block == 0 ? 2 : 3, first = block == 0 ? 0 : 3, end = block == 0 ? 3 : 5;
      put_int(is_41 ? dimension : 7), put_int(is_41 ? 7 : dimension), put_int(block == 0 ? 1 : 0),
          put_size(end - first);
      end_line();
      if (is_41)
        for (int v = first; v < end; ++v) put_size(11 + v), end_line();
      for (int v = first; v < end; ++v) {
        if (!is_41) put_int(11 + v);
        put_place(v);
        if (block == 0) put(0.25), put(0.75);
        end_line();
      }
    }
  } else {
    file += "5\n";
    for (int v = 0; v < 5; ++v) put_int(11 + v), put_place(v), end_line();
  }
  end_section(is_old ? "$ENDNOD" : "$EndNodes");
  file += is_old ? "$ELM\n" : "$Elements\n";
  if (is_4) {
    put_size(static_cast<int>(elements.size())), put_size(static_cast<int>(elements.size()));
    if (is_41) put_size(1), put_size(static_cast<int>(elements.size()));
    end_line();
  } else {
    file += std::to_string(elements.size()) + "\n";
  }
  int number = 0;
  for (const auto& [type, nodes] : elements) {
    const int physical = type == 4 ? 6 : 5;
    ++number;
    if (is_4) {
      put_int(is_41 ? 3 : 7), put_int(is_41 ? 7 : 3), put_int(type), put_size(1), end_line();
      put_tag(number);
    } else if (is_text) {
      put_int(number), put_int(type);
      if (is_old)
        put_int(physical), put_int(7), put_int(static_cast<int>(nodes.size()));
      else
        put_int(2), put_int(physical), put_int(7);
    } else {
      put_int(type), put_int(1), put_int(2), put_int(number), put_int(physical), put_int(7);
    }
    for (const int node : nodes) put_tag(node);
    end_line();
  }
  end_section(is_old ? "$ENDELM" : "$EndElements");
  return file;
}

/// A box of 2 x 3 x 5 m: two prisms.
inline const std::string gmsh_prisms =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
    "$Nodes\n8\n"
    "1 0 0 0\n2 2 0 0\n3 2 3 0\n4 0 3 0\n"
    "5 0 0 5\n6 2 0 5\n7 2 3 5\n8 0 3 5\n"
    "$EndNodes\n"
    "$Elements\n2\n"
    "1 6 0 1 2 3 5 6 7\n"
    "2 6 0 1 3 4 5 7 8\n"
    "$EndElements\n";

inline const std::string tetgen_node =
    "# points\n"                          // 1
    "5 3 1 1\n"                           // 2
    "1  0 0 0  7.5 0\n"                   // 3
    "2  1 0 0  7.5 1 # with a comment\n"  // 4
    "\n"                                  // 5
    "3  0 1 0  7.5 0\n"                   // 6
    "4  0 0 1  7.5 0\n"                   // 7
    "5  0 0 -1 7.5 0\n"                   // 8
    "# made by hand\n";                   // 9

inline const std::string tetgen_ele =
    "2 4 1\n"          // 1
    "1  1 2 3 4  1\n"  // 2
    "2  1 3 2 5  2\n"  // 3
    "# end\n";         // 4

/// Groups in a line: "name: 0 1 2; other: 3".
inline std::string to_text(const std::vector<MeshGroup>& groups) {
  std::string text;
  for (const auto& [name, members] : groups) {
    text += (text.empty() ? "" : "; ") + name + ":";
    for (const int member : members) text += " " + std::to_string(member);
  }
  return text;
}

/// The mesh above, whatever the file called its vertices.
inline void expect_two_tetrahedra(const TetMesh& mesh) {
  const TetMesh expected = two_tetrahedra();
  EXPECT_EQ(mesh.vertices, expected.vertices);
  EXPECT_EQ(mesh.tetrahedra, expected.tetrahedra);
  EXPECT_EQ(mesh.repairs.reoriented, 0);
  EXPECT_EQ(mesh.repairs.dropped_vertices, 0);
}

}  // namespace penalty::testing
