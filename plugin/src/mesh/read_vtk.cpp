// VTK legacy files with an UNSTRUCTURED_GRID, ASCII or BINARY (big-endian).
#include <bit>
#include <cstring>
#include <limits>

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
    const std::string_view magic = text_.rest_of_line();
    if (!lower_case(magic).starts_with("# vtk datafile version"))
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

  // Until version 4: the number of corners before the corners of each cell.
  void read_counted_cells(std::int64_t cells, std::int64_t size) {
    std::vector<std::int64_t> binary_list;
    if (binary_) binary_list = integers(size, 4, "the cells");
    std::int64_t used = 0;
    cell_begins_.push_back(0);
    for (std::int64_t i = 0; i < cells; ++i) {
      text_.within("cell", i);
      if (used >= size) text_.fail("the list of " + std::to_string(size) + " numbers ends before it");
      const std::int64_t corners =
          binary_ ? binary_list[static_cast<std::size_t>(used)] : text_.integer("the number of corners");
      ++used;
      if (corners < 0 || corners > size - used)
        text_.fail("the number of corners is " + std::to_string(corners) + ", the list has room for " +
                   std::to_string(size - used));
      for (std::int64_t k = 0; k < corners; ++k, ++used) {
        corners_.push_back(binary_ ? binary_list[static_cast<std::size_t>(used)] : text_.integer("a corner"));
        if (!binary_) corner_lines_.push_back(text_.line());
      }
      cell_begins_.push_back(static_cast<std::int64_t>(corners_.size()));
    }
    text_.within({});
    if (used != size)
      text_.fail("the cells take " + std::to_string(used) + " numbers, not the " + std::to_string(size) + " announced");
  }

  void read_types() {
    const std::int64_t count = text_.count("the number of cell types", binary_ ? 4 : 1);
    const std::int64_t cells = std::max<std::int64_t>(static_cast<std::int64_t>(cell_begins_.size()) - 1, 0);
    if (count != cells)
      text_.fail("there are " + std::to_string(count) + " cell types for " + std::to_string(cells) + " cells");
    std::vector<std::int64_t> binary_types;
    if (binary_) binary_types = integers(count, 4, "the cell types");
    for (std::int64_t i = 0; i < count; ++i) {
      text_.within("cell", i);
      add_cell(static_cast<std::size_t>(i),
               binary_ ? binary_types[static_cast<std::size_t>(i)] : text_.integer("the type"));
    }
  }

  void add_cell(std::size_t cell, std::int64_t type) {
    switch (type) {
      case 10:
      case 24:
        break;  // tetrahedron; of second order, corners first
      case 0:
      case 1:
      case 2:
      case 3:
      case 4:
      case 5:
      case 6:
      case 7:
      case 8:
      case 9:  // points, lines, faces
      case 21:
      case 22:
      case 23:
      case 28:
      case 30:
      case 34:
      case 35:
      case 36:
        return;  // the same of higher order
      default:
        text_.fail("type " + std::to_string(type) +
                   (type == 12   ? " (hexahedron)"
                    : type == 11 ? " (voxel)"
                                 : "") +
                   " is not a tetrahedron");
    }
    const auto begin = static_cast<std::size_t>(cell_begins_[cell]);
    const std::size_t corners = static_cast<std::size_t>(cell_begins_[cell + 1]) - begin;
    const std::size_t wanted = type == 10 ? 4 : 10;
    if (corners != wanted)
      text_.fail("a tetrahedron with " + std::to_string(corners) + " corners, not " + std::to_string(wanted));
    mesh_.tetrahedra.push_back({corners_[begin], corners_[begin + 1], corners_[begin + 2], corners_[begin + 3]});
    mesh_.origin.tetrahedron_tags.push_back(static_cast<std::int64_t>(cell));
    if (!corner_lines_.empty()) mesh_.origin.tetrahedron_lines.push_back(corner_lines_[begin]);
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
