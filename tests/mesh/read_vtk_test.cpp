#include "files.h"
#include "penalty/mesh/read_mesh.h"

namespace penalty::testing {
namespace {

class ReadVtk : public MeshFiles {
 protected:
  TetMesh read(const std::string& contents) const { return read_mesh(write("a.vtk", contents)); }
  std::string complaint(const std::string& contents) const {
    return mesh_error([&] { read(contents); });
  }
};

TEST_F(ReadVtk, TakesCountedCells) { expect_two_tetrahedra(read(vtk_ascii)); }

TEST_F(ReadVtk, TakesOffsetsAndSkipsFieldsAndMetadata) { expect_two_tetrahedra(read(vtk_offsets)); }

TEST_F(ReadVtk, TakesBigEndianFloats) { expect_two_tetrahedra(read(vtk_binary())); }

TEST_F(ReadVtk, TakesBigEndianOffsetsAndDoubles) { expect_two_tetrahedra(read(vtk_binary_offsets())); }

TEST_F(ReadVtk, TakesBinaryCountsThatLookLikeWhiteSpace) {
  // The coordinates begin with the bytes of a line end and of blanks.
  std::string text = vtk_binary();
  const auto at = text.find("float\n") + 6;
  text.replace(at, 4, "\x20\x0a\x20\x20");  // 1.2e-19
  EXPECT_EQ(read(text).vertices(0, 0), Real{std::bit_cast<float>(0x200a2020u)});
}

TEST_F(ReadVtk, TakesWindowsLineEndsTabsAndCapitals) {
  std::string text;
  for (char c : replaced(vtk_ascii, "1 0 0", "+1\t0\t0")) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_two_tetrahedra(read(text));
  expect_two_tetrahedra(read(replaced(vtk_ascii, "DATASET UNSTRUCTURED_GRID", "dataset unstructured_grid")));
}

TEST_F(ReadVtk, TakesCornersOfSecondOrderTetrahedra) {
  std::string text = replaced(vtk_ascii, "CELLS 3 14\n4 0 1 2 3\n", "CELLS 3 20\n10 0 1 2 3 4 4 4 4 4 4\n");
  text = replaced(text, "10\n5", "24\n5");
  expect_two_tetrahedra(read(text));
}

TEST_F(ReadVtk, KeepsWholeNumbersOnCellsAndPointsAsGroups) {
  const TetMesh mesh = read(vtk_ascii + vtk_data);
  expect_two_tetrahedra(mesh);
  EXPECT_EQ(to_text(mesh.regions), "material id 4: 0; material id -1: 1");
  EXPECT_EQ(to_text(mesh.vertex_sets), "material id 2: 0 1 2; fixed 1: 2; fixed 7: 4; whole 1: 0 1 2; whole 2: 3");
  EXPECT_EQ(to_text(read(vtk_offsets).regions), "heat 1: 0; heat 3: 1");  // whole numbers, if of a floating-point type
  EXPECT_EQ(
      to_text(
          read(vtk_ascii + "CELL_DATA 3\nSCALARS id long\nLOOKUP_TABLE t\n1 2 3\nLOOKUP_TABLE t 1\n0 0 0 0\n").regions),
      "id 1: 0; id 3: 1");
}

TEST_F(ReadVtk, KeepsGroupsOfBinaryFiles) {
  const auto with = [](const char* type, const std::string& values) {
    return vtk_binary() + "CELL_DATA 2\nFIELD FieldData 1\nregion 1 2 " + type + "\n" + values + "\n";
  };
  const auto both = [](auto value) { return big_endian(value) + big_endian(static_cast<decltype(value)>(3)); };
  EXPECT_EQ(to_text(read(with("int", both(std::int32_t{-2}))).regions), "region -2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("vtkIdType", both(std::int32_t{-2}))).regions), "region -2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("unsigned_char", both(std::uint8_t{254}))).regions), "region 254: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("char", both(std::int8_t{-2}))).regions), "region -2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("unsigned_short", both(std::uint16_t{65534}))).regions), "region 65534: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("short", both(std::int16_t{-2}))).regions), "region -2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("unsigned_int", both(std::uint32_t{4294967294}))).regions),
            "region 4294967294: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("vtktypeint64", both(std::int64_t{-2}))).regions), "region -2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("float", both(2.0f))).regions), "region 2: 0; region 3: 1");
  EXPECT_EQ(to_text(read(with("double", both(2.5))).regions), "");
  EXPECT_EQ(complaint(with("double", big_endian(2.5))).substr(0, 7), "a.vtk:1");
}

TEST_F(ReadVtk, NamesDataThatDoesNotFit) {
  EXPECT_EQ(complaint(vtk_ascii + "CELL_DATA 2\n"), "a.vtk:19: there is data for 2 cells, there are 3");
  EXPECT_EQ(complaint(vtk_ascii + "POINT_DATA 6\n"), "a.vtk:19: there is data for 6 points, there are 5");
  const std::string head = vtk_ascii + "CELL_DATA 3\nSCALARS id int\n";
  EXPECT_EQ(complaint(head + "1"), "a.vtk:20: the file ends within the array 'id'");
  EXPECT_EQ(complaint(head + "1 2   "), "a.vtk:21: the file ends where a value should stand");
  EXPECT_EQ(complaint(head + "1 x 3"), "a.vtk:21: a value is 'x', not a number");
  expect_two_tetrahedra(read(vtk_ascii + "CELL_DATA 3\nSCALARS id what\n1 2 3\n"));  // data alone is lost
}

// What Bullet ships and its own reader takes.
TEST_F(ReadVtk, TakesHeadersAsOthersWriteThem) {
  expect_two_tetrahedra(read(replaced(vtk_ascii, "# vtk DataFile", "#vtk DataFile")));
  for (const char* size : {"11", "1", "3"}) {
    SCOPED_TRACE(size);
    expect_two_tetrahedra(read(replaced(vtk_ascii, "CELLS 3 14", std::string("CELLS 3 ") + size)));
  }
  std::string text = replaced(replaced(vtk_ascii, "CELLS 3 14", "CELLS 2 8"), "3 0 1 2\n", "");
  text.resize(text.find("CELL_TYPES"));
  expect_two_tetrahedra(read(text + "CELL_TYPES 10\n"));
  EXPECT_EQ(complaint(replaced(text, "4 0 2 1 4", "3 0 2 1") + "CELL_TYPES 10\n"),
            "a.vtk:14: the number of cell types is 10, more than the rest of the file can hold");
}

TEST_F(ReadVtk, TakesVoxelsByRows) {
  const TetMesh mesh = read(
      "# vtk DataFile Version 2.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
      "0 0 0  2 0 0  0 3 0  2 3 0  0 0 1  2 0 1  0 3 1  2 3 1\n"
      "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n11\n");
  EXPECT_NEAR(volume(mesh), 6, 1e-14);
  EXPECT_EQ(to_text(mesh.repairs), "cut 1 solid into tetrahedra");
}

TEST_F(ReadVtk, ReportsRepairs) {
  EXPECT_EQ(read(replaced(vtk_ascii, "4 0 2 1 4", "4 0 1 2 4")).repairs.reoriented, 1);
  EXPECT_EQ(read(replaced(vtk_ascii, "10\n5\n10", "10\n5\n5")).repairs.dropped_vertices, 1);
}

TEST_F(ReadVtk, NamesFileLineElementAndValue) {
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1", "0 nan -1")), "a.vtk:10: vertex 4: coordinate y is nan");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1", "0 0 1e999")), "a.vtk:10: vertex 4: coordinate z is inf");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1", "0 0 x")), "a.vtk:10: vertex 4: coordinate z is 'x', not a number");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1", "0 0 1,5")),
            "a.vtk:10: vertex 4: coordinate z is '1,5', not a number");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "4 0 2 1 4", "4 0 2 1 9")),
            "a.vtk:14: tetrahedron 2: vertex index 9 is outside 0 to 4");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "4 0 2 1 4", "4 0 2 1 99999999999")),
            "a.vtk:14: tetrahedron 2: vertex index 99999999999 is outside 0 to 4");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "4 0 2 1 4", "4 0 2 1 1.5")),
            "a.vtk:14: cell 2: a corner is '1.5', not an integer");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "4 0 2 1 4", "4 0 2 1 1")),
            "a.vtk:14: tetrahedron 2: vertex 1 is used twice");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1", "3 4 0")),
            "a.vtk:14: tetrahedron 2: flat: volume 0 at a longest edge of 5");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "10\n5", "12\n5")), "a.vtk:16: cell 0: a hexahedron with 4 corners, not 8");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "10\n5", "42\n5")),
            "a.vtk:16: cell 0: type 42 is not read: save the mesh with cells of first or second order");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "5\n10", "10\n10")), "a.vtk:17: cell 1: a tetrahedron with 3 corners, not 4");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "10\n5\n10\n", "9\n5\n9\n")),
            "a.vtk: no solids, only points, lines and faces (3): fill them with tetrahedra (TetGen), or give a closed "
            "surface as .obj, .ply or .stl");
}

TEST_F(ReadVtk, NamesBrokenStructure) {
  EXPECT_EQ(complaint("solid cube\n"),
            "a.vtk:1: not a legacy VTK file: it does not begin with '# vtk DataFile Version'");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "ASCII", "EBCDIC")),
            "a.vtk:3: found 'ebcdic' where ASCII or BINARY should stand");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "UNSTRUCTURED_GRID", "POLYDATA")),
            "a.vtk:4: the data set is 'POLYDATA', not UNSTRUCTURED_GRID");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "5 double", "5 bit")),
            "a.vtk:5: coordinates of type 'bit' are not read: float and double are");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "0 0 -1\n", "")),
            "a.vtk:10: vertex 4: coordinate x is 'CELLS', not a number");
  const auto binary_size = [](int size) {
    return replaced(vtk_binary(), "CELLS 2 10", "CELLS 2 " + std::to_string(size));
  };
  EXPECT_EQ(complaint(binary_size(9)), "a.vtk:8: cell 1: the number of corners is 4, the list has room for 3");
  EXPECT_EQ(complaint(binary_size(11)), "a.vtk:8: the cells take 10 numbers, not the 11 announced");
  EXPECT_EQ(complaint(replaced(vtk_ascii, "CELL_TYPES 3", "CELL_TYPES 2")),
            "a.vtk:15: there are 2 cell types for 3 cells");
  EXPECT_EQ(complaint(replaced(vtk_offsets, "0 4 7 11", "0 7 4 11")),
            "a.vtk:18: cell 2: offset 4 is out of order or beyond the 11 corners");
  EXPECT_EQ(complaint(vtk_ascii.substr(0, vtk_ascii.find("4 0 2 1"))),
            "a.vtk:11: the size of the cell list is 14, more than the rest of the file can hold");
  EXPECT_EQ(complaint(vtk_ascii.substr(0, vtk_ascii.find("\n10\n5") - 10)),
            "a.vtk:15: found 'ce' where a section should begin; the section CELL_TYPES is missing");
  EXPECT_EQ(complaint(vtk_ascii.substr(0, vtk_ascii.find("CELL_TYPES"))),
            "a.vtk:15: the section CELL_TYPES is missing");
}

}  // namespace
}  // namespace penalty::testing
