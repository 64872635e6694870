#include "penalty/mesh/read_mesh.h"
#include "vtk_xml_files.h"

namespace penalty::testing {
namespace {

class ReadVtkXml : public MeshFiles {
 protected:
  TetMesh read(const std::string& contents, const char* name = "a.vtu") const {
    return read_mesh(write(name, contents));
  }
  std::string complaint(const std::string& contents) const {
    return mesh_error([&] { read(contents); });
  }
};

TEST_F(ReadVtkXml, TakesEveryFormatInEveryOrderPlainAndCompressed) {
  const std::vector<VtkXmlForm> forms = vtk_xml_forms();
  ASSERT_EQ(forms.size(), 41u);
  for (const VtkXmlForm& form : forms) {
    const std::string text = vtk_xml(form);
    SCOPED_TRACE(text);
    const TetMesh mesh = read(text);
    expect_two_tetrahedra(mesh);
    EXPECT_EQ(to_text(mesh.regions), "material id 4: 0; material id -1: 1");
    EXPECT_EQ(to_text(mesh.vertex_sets), "material id 2: 0 1 2; fixed 1: 2; fixed 7: 4");
  }
}

TEST_F(ReadVtkXml, IsToldFromLegacyFilesByWhatIsInThem) {
  expect_two_tetrahedra(read(vtk_xml(), "a.vtk"));
  expect_two_tetrahedra(read("\n " + vtk_xml(), "b.vtk"));
  expect_two_tetrahedra(read(vtk_ascii, "a.vtu"));
  expect_two_tetrahedra(read("\xef\xbb\xbf" + vtk_xml()));
  std::string windows;
  for (const char c : vtk_xml()) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_two_tetrahedra(read(windows));
}

TEST_F(ReadVtkXml, JoinsPieces) {
  for (const char* format : {"ascii", "binary", "appended"}) {
    SCOPED_TRACE(format);
    VtkXmlWriter writer({.format = format});
    const auto piece = [&](double side, int region, bool with_heat) {
      return "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>" +
             writer.array("type=\"Float32\" NumberOfComponents=\"3\"",
                          std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, static_cast<float>(side)}) +
             "</Points><Cells>" +
             writer.array("type=\"UInt16\" Name=\"connectivity\"", std::vector<std::uint16_t>{0, 1, 2, 3}) +
             writer.array("type=\"UInt32\" Name=\"offsets\"", std::vector<std::uint32_t>{4}) +
             writer.array("type=\"Int8\" Name=\"types\"", std::vector<std::int8_t>{10}) + "</Cells><CellData>" +
             writer.array("type=\"Int16\" Name=\"region\"",
                          std::vector<std::int16_t>{static_cast<std::int16_t>(region)}) +
             (with_heat ? writer.array("type=\"Int64\" Name=\"heat\"", std::vector<std::int64_t>{1}) : "") +
             "</CellData></Piece>\n";
    };
    const std::string empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>\n";
    const std::string pieces = piece(1, 3, true) + piece(-1, 5, false);
    const TetMesh mesh = read(writer.file(pieces));
    EXPECT_EQ(mesh.vertices.cols(), 5);  // those of the face between them are merged
    EXPECT_EQ(mesh.tetrahedra.size(), 2u);
    EXPECT_EQ(mesh.repairs.merged_vertices, 3);
    EXPECT_EQ(to_text(mesh.regions), "region 3: 0; region 5: 1") << "heat is on one piece only";
    EXPECT_EQ(read(writer.file(pieces + empty)).tetrahedra.size(), 2u);
  }
}

TEST_F(ReadVtkXml, TakesKeysAmongTheDataAndCommentsAroundIt) {
  const std::string key = "<InformationKey name=\"RANGE\"><Value index=\"0\">7</Value></InformationKey>";
  expect_two_tetrahedra(read(replaced(vtk_xml(), "10 5 10 \n", "10 5 10 \n" + key)));
  expect_two_tetrahedra(read(replaced(vtk_xml(), "10 5 10 \n", key + "<!-- 1 2 -->10 5 10\n")));
  const std::string field =
      "<FieldData><DataArray type=\"String\" Name=\"note\" format=\"ascii\">65</DataArray></FieldData>";
  expect_two_tetrahedra(read(replaced(vtk_xml(), "<Piece", field + "<Piece")));
}

TEST_F(ReadVtkXml, NamesFileLineArrayAndValue) {
  const std::string text = vtk_xml();
  const auto broken = [&](const char* from, const char* to) { return complaint(replaced(text, from, to)); };
  EXPECT_EQ(broken("type=\"UnstructuredGrid\"", "type=\"PolyData\""),
            "a.vtu:2: the data set is 'PolyData', not UnstructuredGrid");
  EXPECT_EQ(broken("type=\"UnstructuredGrid\"", "type=\"PUnstructuredGrid\""),
            "a.vtu:2: the data set is 'PUnstructuredGrid', not UnstructuredGrid: read its pieces, or save it as one");
  EXPECT_EQ(broken("LittleEndian\"", "LittleEndian\" compressor=\"vtkLZ4DataCompressor\""),
            "a.vtu:2: compressed by 'vtkLZ4DataCompressor': save it with zlib or uncompressed");
  EXPECT_EQ(broken("0 1 2 3 0", "0 1 2 5 0"), "a.vtu:25: corner 3 is vertex 5, there are 5");
  EXPECT_EQ(broken("0 1 2 3 0", "0 1 2 x 0"), "a.vtu:26: a number of array 'connectivity' is 'x', not an integer");
  EXPECT_EQ(broken("4 7 11", "4 3 11"), "a.vtu:28: cell 1: offset 3 is out of order");
  EXPECT_EQ(broken("4 7 11", "4 7 12"), "a.vtu:25: array 'connectivity': ends after 11 of 12 numbers");
  EXPECT_EQ(broken("4 7 11", "5 8 11"), "a.vtu:31: cell 0: a tetrahedron with 5 corners, not 4");
  EXPECT_EQ(broken("10 5 10", "10 5 42"),
            "a.vtu:31: cell 2: type 42 is not read: save the mesh with cells of first or second order");
  EXPECT_EQ(broken("NumberOfPoints=\"5\"", "NumberOfPoints=\"-5\""),
            "a.vtu:5: NumberOfPoints is '-5', must be a count");
  EXPECT_EQ(broken("NumberOfPoints=\"5\"", "NumberOfPoints=\"5x\""), "a.vtu:5: NumberOfPoints is '5x', not an integer");
  EXPECT_EQ(broken("NumberOfCells=\"3\"", "NumberOfCells=\"3000000000\""),
            "a.vtu:5: NumberOfCells is '3000000000', must be a count");
  EXPECT_EQ(broken("NumberOfPoints=\"5\"", "NumberOfPoints=\"500000000\"").substr(0, 60),
            "a.vtu:20: the size of array 'Points' is 1500000000, more tha");
  EXPECT_EQ(broken("Name=\"types\"", "Name=\"kinds\""), "a.vtu:24: there is no array 'types'");
  EXPECT_EQ(broken("type=\"Float64\"", "type=\"Float16\""), "a.vtu:20: array 'Points': type 'Float16' is not read");
  for (const char* format : {"ascii", "binary"})  // 1e300 is no number of a corner
    EXPECT_EQ(complaint(replaced(vtk_xml({.format = format}), "\"Int64\" Name=\"conn", "\"Float64\" Name=\"conn")),
              "a.vtu:25: array 'connectivity': type 'Float64' is not read");
  EXPECT_EQ(broken("</Cells>", "</Cell>").substr(0, 31), "a.vtu:34: not well-formed XML: ");
  EXPECT_EQ(complaint("<html></html>"), "a.vtu:1: not a file of VTK: there is no VTKFile");
  EXPECT_EQ(broken("<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">", "<Part>").substr(0, 9), "a.vtu:35:");
}

TEST_F(ReadVtkXml, NamesEncodedDataThatIsNotWhatItShouldBe) {
  const std::string binary = vtk_xml({.format = "binary"});
  const std::string types = base64(std::string("\3\0\0\0", 4));  // the size of the last array, which has three bytes
  EXPECT_EQ(
      complaint(replaced(binary, types + base64("\n\5\n"), base64(std::string("\4\0\0\0", 4)) + base64("\n\5\n\n"))),
      "a.vtu:31: array 'types': 4 bytes, not 3");
  EXPECT_EQ(complaint(replaced(binary, types + base64("\n\5\n"), types + "Cg*K")),
            "a.vtu:31: array 'types': the data ends early or is not encoded as it should be");
  EXPECT_EQ(complaint(replaced(binary, types + base64("\n\5\n"), types)),
            "a.vtu:31: array 'types': the data ends early or is not encoded as it should be");
  const std::string packed = vtk_xml({.format = "appended", .raw = true, .compressed = true});
  for (std::size_t k = packed.find('_') + 1; k < packed.rfind("\n</Appended"); k += 3) {
    std::string broken = packed;
    broken[k] = static_cast<char>(broken[k] ^ 0x55);
    SCOPED_TRACE("byte " + std::to_string(k));
    if (const std::string what = complaint(broken); what.empty())
      expect_two_tetrahedra(read(broken));  // in an array that groups nothing
    else
      EXPECT_EQ(what.substr(0, 6), "a.vtu:");
  }
  EXPECT_EQ(complaint(replaced(packed, "offset=\"0\"", "offset=\"100000\"")).substr(0, 57),
            "a.vtu:7: array 'fixed': offset '100000' is not in the app");
}

TEST_F(ReadVtkXml, RefusesPiecesThatAllClaimTheSameData) {
  VtkXmlWriter writer({.format = "appended", .raw = true});
  std::string piece = "<Piece NumberOfPoints=\"5000\" NumberOfCells=\"1\"><Points>\n";
  std::vector<double> coordinates(15000, 0.0);
  for (int k = 0; k < 15000; ++k) coordinates[k] = static_cast<double>(std::int64_t{k} * k * k % 1009);
  piece +=
      writer.array("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", coordinates) + "</Points><Cells>\n";
  piece += writer.array("type=\"Int8\" Name=\"connectivity\"", std::vector<std::int8_t>{0, 1, 2, 3});
  piece += writer.array("type=\"Int8\" Name=\"offsets\"", std::vector<std::int8_t>{4});
  piece += writer.array("type=\"Int8\" Name=\"types\"", std::vector<std::int8_t>{10}) + "</Cells></Piece>\n";
  EXPECT_EQ(read(writer.file(piece)).tetrahedra.size(), 1u);
  std::string pieces;
  for (int k = 0; k < 100; ++k) pieces += piece;
  EXPECT_EQ(complaint(writer.file(pieces)),
            "a.vtu:20: array 'Points': with it there is more data than the file can hold");
}

}  // namespace
}  // namespace penalty::testing
