// VTK legacy files with an UNSTRUCTURED_GRID, ASCII or BINARY (big-endian).
#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "raw_mesh.h"

namespace penalty {
namespace {

// The bytes of a number in a data section; 0 for a type that VTK does not know.
std::size_t size_of(std::string_view type) {
  const std::string name = lower_case(type);
  if (name == "char" || name == "unsigned_char" || name == "signed_char") return 1;
  if (name == "short" || name == "unsigned_short") return 2;
  if (name == "int" || name == "unsigned_int" || name == "float") return 4;
  if (name == "long" || name == "unsigned_long" || name == "double" || name == "vtktypeint64" || name == "vtkidtype")
    return 8;
  return 0;
}

// What VTK says of a type of cells. All list their corners first, and go round as ours do, but voxels.
struct CellType {
  int nodes;                   // 0: any number, of any order; -1: unknown
  std::optional<Solid> solid;  // none: points, lines, faces
  const char* name;
};

CellType cell_type(std::int64_t type) {
  const bool is_lower = (type >= 0 && type <= 9) || (type >= 21 && type <= 23) || type == 28 || type == 30 ||
                        (type >= 34 && type <= 36) || (type >= 68 && type <= 70) || (type >= 75 && type <= 77);
  if (is_lower) return {0, std::nullopt, ""};
  switch (type) {
    case 10:
      return {4, Solid::tetrahedron, "tetrahedron"};
    case 11:
      return {8, Solid::hexahedron, "voxel"};
    case 12:
      return {8, Solid::hexahedron, "hexahedron"};
    case 13:
      return {6, Solid::prism, "wedge"};
    case 14:
      return {5, Solid::pyramid, "pyramid"};
    case 24:
      return {10, Solid::tetrahedron, "tetrahedron"};
    case 25:
      return {20, Solid::hexahedron, "hexahedron"};
    case 26:
      return {15, Solid::prism, "wedge"};
    case 27:
      return {13, Solid::pyramid, "pyramid"};
    case 29:
      return {27, Solid::hexahedron, "hexahedron"};
    case 31:
      return {12, Solid::prism, "wedge"};
    case 32:
      return {18, Solid::prism, "wedge"};
    case 33:
      return {24, Solid::hexahedron, "hexahedron"};
    case 71:
    case 78:
      return {0, Solid::tetrahedron, "tetrahedron"};
    case 72:
    case 79:
      return {0, Solid::hexahedron, "hexahedron"};
    case 73:
    case 80:
      return {0, Solid::prism, "wedge"};
    case 74:
    case 81:
      return {0, Solid::pyramid, "pyramid"};
    default:
      return {-1, std::nullopt, ""};
  }
}

template <class T>
T big_endian(const char* bytes) {
  std::array<char, sizeof(T)> raw;
  for (std::size_t k = 0; k < sizeof(T); ++k)
    raw[k] = bytes[std::endian::native == std::endian::little ? sizeof(T) - 1 - k : k];
  return std::bit_cast<T>(raw);
}

class VtkReader {
 public:
  VtkReader(std::string file, std::string_view contents) : text_(std::move(file), contents) {
    mesh_.origin.vertex_file = mesh_.origin.tetrahedron_file = text_.file();
  }

  TetMesh read() {
    read_header();
    bool points = false, cells = false, types = false;
    while (!(points && cells && types)) {  // what follows is data on points and cells
      text_.within({});
      if (text_.at_end()) text_.fail(missing(points, cells));
      const std::string keyword = lower_case(text_.word("a section"));
      if (keyword == "points" && !points)
        read_points(), points = true;
      else if (keyword == "cells" && !cells)
        read_cells(), cells = true;
      else if (keyword == "cell_types" && cells && !types)
        read_types(), types = true;
      else if (keyword == "field")
        skip_field();
      else if (keyword == "metadata")
        skip_metadata();
      else
        text_.fail("found " + in_quotes(keyword) + " where a section should begin; " + missing(points, cells));
    }
    const std::string source = text_.file();
    return std::move(mesh_).finish(source);
  }

 private:
  static std::string missing(bool points, bool cells) {
    return std::string("the section ") + (points ? cells ? "CELL_TYPES" : "CELLS" : "POINTS") + " is missing";
  }

  void read_header() {
    std::string magic = lower_case(text_.rest_of_line());
    if (magic.starts_with('<'))
      text_.fail("VTK's XML is not read: save it as legacy VTK, as ParaView and `meshio convert` do");
    std::erase(magic, ' ');
    if (!magic.starts_with("#vtkdatafileversion"))
      text_.fail("not a legacy VTK file: it does not begin with '# vtk DataFile Version'");
    text_.rest_of_line();  // title
    const std::string form = lower_case(text_.word("ASCII or BINARY"));
    if (form != "ascii" && form != "binary")
      text_.fail("found " + in_quotes(form) + " where ASCII or BINARY should stand");
    binary_ = form == "binary";
    if (lower_case(text_.word("DATASET")) != "dataset") text_.fail("DATASET is missing");
    const std::string_view dataset = text_.word("the kind of data set");
    if (lower_case(dataset) != "unstructured_grid")
      text_.fail("the data set is " + in_quotes(dataset) + ", not UNSTRUCTURED_GRID");
  }

  // Raw numbers begin on the line after their heading.
  std::string_view raw(std::int64_t count, std::size_t size, std::string_view what) {
    text_.rest_of_line();
    return text_.bytes(static_cast<std::size_t>(count) * size, what);
  }

  std::vector<std::int64_t> integers(std::int64_t count, std::size_t size, std::string_view what) {
    std::vector<std::int64_t> numbers;
    numbers.reserve(static_cast<std::size_t>(count));
    if (binary_) {
      const std::string_view bytes = raw(count, size, what);
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        numbers.push_back(size == 8 ? big_endian<std::int64_t>(bytes.data() + 8 * i)
                                    : std::int64_t{big_endian<std::int32_t>(bytes.data() + 4 * i)});
    } else {
      for (std::int64_t i = 0; i < count; ++i) numbers.push_back(text_.integer(what));
    }
    return numbers;
  }

  void read_points() {
    const std::int64_t count = text_.count("the number of points", binary_ ? 12 : 6);
    const std::string_view type = text_.word("the type of the coordinates");
    const bool is_float = lower_case(type) == "float";
    if (size_of(type) == 0 || (binary_ && !is_float && lower_case(type) != "double"))
      text_.fail("coordinates of type " + in_quotes(type) + " are not read: float and double are");
    mesh_.coordinates.reserve(3 * static_cast<std::size_t>(count));
    if (binary_) {
      const std::size_t size = is_float ? 4 : 8;
      const std::string_view bytes = raw(3 * count, size, "the coordinates");
      for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(count); ++i)
        mesh_.coordinates.push_back(is_float ? Real{big_endian<float>(bytes.data() + 4 * i)}
                                             : big_endian<double>(bytes.data() + 8 * i));
    } else {
      for (std::int64_t i = 0; i < count; ++i) {
        text_.within("vertex", i);
        mesh_.add_vertex(text_);
      }
    }
  }

  void read_cells() {
    const std::int64_t first = text_.count("the number of cells", 1);
    const std::int64_t second = text_.count("the size of the cell list", binary_ ? 4 : 2);
    if (text_.peek() == "OFFSETS")  // binary lists begin with a count, never with this word
      read_offsets(first, second);
    else
      read_counted_cells(first, second);
  }

  // Since version 5: where each cell begins and ends, then all corners.
  void read_offsets(std::int64_t offset_count, std::int64_t corner_count) {
    text_.expect("OFFSETS");
    const std::size_t offset_size = size_of(text_.word("the type of the offsets"));
    if (offset_size != 4 && offset_size != 8) text_.fail("the offsets must be of a four or eight byte integer type");
    if (binary_ && static_cast<std::size_t>(offset_count) > text_.remaining() / offset_size)
      text_.fail("the file ends within the offsets of the cells");
    cell_begins_ = integers(offset_count, offset_size, "an offset");
    text_.expect("CONNECTIVITY");
    const std::size_t corner_size = size_of(text_.word("the type of the corners"));
    if (corner_size != 4 && corner_size != 8) text_.fail("the corners must be of a four or eight byte integer type");
    read_corners(corner_count, corner_size);
    for (std::size_t i = 0; i < cell_begins_.size(); ++i)
      if (cell_begins_[i] < (i == 0 ? 0 : cell_begins_[i - 1]) || cell_begins_[i] > corner_count)
        text_.fail("cell " + std::to_string(i) + ": offset " + std::to_string(cell_begins_[i]) +
                   " is out of order or beyond the " + std::to_string(corner_count) + " corners");
  }

  void read_corners(std::int64_t count, std::size_t size) {
    if (binary_ && static_cast<std::size_t>(count) > text_.remaining() / size)
      text_.fail("the file ends within the corners of the cells");
    if (binary_) {
      corners_ = integers(count, size, "the corners");
      return;
    }
    for (std::int64_t i = 0; i < count; ++i) {
      corners_.push_back(text_.integer("a corner"));
      corner_lines_.push_back(text_.line());
    }
  }

  // Until version 4: the number of corners before the corners of each cell. Some programs announce another size than that
  // of the list: only a binary list goes by it.
  void read_counted_cells(std::int64_t cells, std::int64_t size) {
    std::vector<std::int64_t> list;
    if (binary_) list = integers(size, 4, "the cells");
    std::int64_t used = 0;
    const auto next = [&](const char* what) {
      return binary_ ? list[static_cast<std::size_t>(used++)] : text_.integer(what);
    };
    cell_begins_.push_back(0);
    for (std::int64_t i = 0; i < cells; ++i) {
      text_.within("cell", i);
      if (binary_ && used >= size) text_.fail("the list of " + std::to_string(size) + " numbers ends before it");
      const std::int64_t corners = next("the number of corners");
      const std::int64_t room = binary_ ? size - used : static_cast<std::int64_t>(text_.remaining() / 2);
      if (corners < 0 || corners > room)
        text_.fail("the number of corners is " + std::to_string(corners) + ", the list has room for " +
                   std::to_string(room));
      for (std::int64_t k = 0; k < corners; ++k) {
        corners_.push_back(next("a corner"));
        if (!binary_) corner_lines_.push_back(text_.line());
      }
      cell_begins_.push_back(static_cast<std::int64_t>(corners_.size()));
    }
    text_.within({});
    if (binary_ && used != size)
      text_.fail("the cells take " + std::to_string(used) + " numbers, not the " + std::to_string(size) + " announced");
  }

  void read_types() {
    const std::int64_t announced = text_.integer("the number of cell types");
    const std::size_t cells = cell_begins_.empty() ? 0 : cell_begins_.size() - 1;
    if (!binary_ && text_.peek().empty() && all_have_four_corners()) {  // Bullet's own samples end here
      for (std::size_t i = 0; i < cells; ++i) add_cell(i, 10);
      return;
    }
    const std::int64_t count = text_.checked_count(announced, "the number of cell types", binary_ ? 4 : 1);
    if (static_cast<std::size_t>(count) != cells)
      text_.fail("there are " + std::to_string(count) + " cell types for " + std::to_string(cells) + " cells");
    std::vector<std::int64_t> binary_types;
    if (binary_) binary_types = integers(count, 4, "the cell types");
    for (std::size_t i = 0; i < cells; ++i) {
      text_.within("cell", static_cast<std::int64_t>(i));
      add_cell(i, binary_ ? binary_types[i] : text_.integer("the type"));
    }
  }

  bool all_have_four_corners() const {
    for (std::size_t i = 0; i + 1 < cell_begins_.size(); ++i)
      if (cell_begins_[i + 1] - cell_begins_[i] != 4) return false;
    return true;
  }

  void add_cell(std::size_t cell, std::int64_t type) {
    const CellType known = cell_type(type);
    if (known.nodes < 0)
      text_.fail("type " + std::to_string(type) + " is not read: save the mesh with cells of first or second order");
    if (!known.solid) {
      mesh_.count_skipped();
      return;
    }
    const auto begin = static_cast<std::size_t>(cell_begins_[cell]);
    const std::size_t nodes = static_cast<std::size_t>(cell_begins_[cell + 1]) - begin;
    const auto size = static_cast<std::size_t>(*known.solid);
    const bool fits = known.nodes > 0 ? nodes == static_cast<std::size_t>(known.nodes) : nodes >= size;
    if (!fits)
      text_.fail(std::string("a ") + known.name + " with " + std::to_string(nodes) + " corners, not " +
                 std::to_string(known.nodes > 0 ? known.nodes : static_cast<int>(size)));
    std::array<std::int64_t, 8> corners;
    std::copy_n(corners_.begin() + static_cast<std::ptrdiff_t>(begin), size, corners.begin());
    if (type == 11) {  // a voxel goes by rows
      std::swap(corners[2], corners[3]);
      std::swap(corners[6], corners[7]);
    }
    mesh_.add(*known.solid, corners, static_cast<std::int64_t>(cell), corner_lines_.empty() ? 0 : corner_lines_[begin]);
    if (nodes > size) mesh_.count_reduced();
  }

  void skip_field() {
    text_.word("the name of the field");
    const std::int64_t arrays = text_.count("the number of arrays", 4);
    for (std::int64_t i = 0; i < arrays; ++i) {
      text_.word("the name of an array");
      const std::int64_t components = text_.count("the number of components", 1);
      const std::int64_t tuples = text_.count("the number of tuples", 1);
      const std::size_t size = size_of(text_.word("the type of an array"));
      if (size == 0) text_.fail("an array of unknown type");
      if (components > 0 && tuples > static_cast<std::int64_t>(text_.remaining()) / components)
        text_.fail("the file ends within an array of the field");
      if (binary_)
        raw(components * tuples, size, "an array of the field");
      else
        for (std::int64_t k = 0; k < components * tuples; ++k) text_.word("a number");
    }
  }

  // Names of components and the like, up to an empty line.
  void skip_metadata() {
    text_.rest_of_line();
    while (!text_.at_line_end()) text_.rest_of_line();
  }

  TextCursor text_;
  RawMesh mesh_;
  bool binary_ = false;
  std::vector<std::int64_t> cell_begins_;  // cell i: corners_[cell_begins_[i]] to before [cell_begins_[i + 1]]
  std::vector<std::int64_t> corners_;
  std::vector<int> corner_lines_;  // empty for binary files
};

}  // namespace

TetMesh read_vtk(const std::filesystem::path& path) {
  const std::string contents = load_file(path);
  return VtkReader(path.string(), contents).read();
}

}  // namespace penalty
