// VTK legacy files with an UNSTRUCTURED_GRID, ASCII or BINARY (big-endian).
#include <charconv>
#include <optional>

#include "raw_mesh.h"
#include "vtk_cells.h"
#include "vtk_numbers.h"

namespace penalty {
namespace {

std::optional<NumberType> legacy_number_type(std::string_view name) {
  using Sort = NumberType::Sort;
  const std::string lower = lower_case(name);
  if (lower == "float") return NumberType{Sort::floating, 4};
  if (lower == "double") return NumberType{Sort::floating, 8};
  const Sort sort = lower.starts_with("unsigned_") ? Sort::natural : Sort::whole;
  const std::string_view width = std::string_view(lower).substr(sort == Sort::natural ? 9 : 0);
  if (width == "char" || lower == "signed_char") return NumberType{sort, 1};
  if (width == "short") return NumberType{sort, 2};
  if (width == "int") return NumberType{sort, 4};
  if (width == "long" || lower == "vtktypeint64" || lower == "vtkidtype") return NumberType{sort, 8};
  return std::nullopt;
}

// The bytes of a number in a data section; 0 for a type that VTK does not know.
std::size_t size_of(std::string_view name) {
  const std::optional<NumberType> type = legacy_number_type(name);
  return type ? type->size : 0;
}

class VtkReader {
 public:
  VtkReader(std::string file, std::string_view contents) : text_(std::move(file), contents) {
    mesh_.origin.vertex_file = mesh_.origin.tetrahedron_file = text_.file();
  }

  TetMesh read() {
    read_header();
    bool points = false, cells = false, types = false;
    while (!(points && cells && types)) {
      text_.within({});
      if (text_.at_end()) text_.fail(missing(points, cells));
      const std::string keyword = lower_case(text_.word("a section"));
      if (keyword == "points" && !points) {
        read_points(), points = true;
      } else if (keyword == "cells" && !cells) {
        read_cells(), cells = true;
      } else if (keyword == "cell_types" && cells && !types) {
        read_types(), types = true;
      } else if (keyword == "field") {
        if (!read_field(-1, [](const VtkArray&) {})) text_.fail("an array of unknown type");
      } else if (keyword == "metadata") {
        skip_metadata();
      } else {
        text_.fail("found " + in_quotes(keyword) + " where a section should begin; " + missing(points, cells));
      }
    }
    read_data();
    const std::string source = text_.file();
    return std::move(mesh_).finish(source);
  }

 private:
  static std::string missing(bool points, bool cells) {
    return std::string("the section ") + (points ? cells ? "CELL_TYPES" : "CELLS" : "POINTS") + " is missing";
  }

  void read_header() {
    std::string magic = lower_case(text_.rest_of_line());
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
        numbers.push_back(
            number_at<std::int64_t>(bytes.data() + i * size, {NumberType::Sort::whole, size}, std::endian::big));
    } else {
      for (std::int64_t i = 0; i < count; ++i) numbers.push_back(text_.integer(what));
    }
    return numbers;
  }

  void read_points() {
    const std::int64_t count = text_.count("the number of points", binary_ ? 12 : 6);
    const std::string_view name = text_.word("the type of the coordinates");
    const std::optional<NumberType> type = legacy_number_type(name);
    if (!type || (binary_ && type->sort != NumberType::Sort::floating))
      text_.fail("coordinates of type " + in_quotes(name) + " are not read: float and double are");
    mesh_.coordinates.reserve(3 * static_cast<std::size_t>(count));
    if (binary_) {
      const std::string_view bytes = raw(3 * count, type->size, "the coordinates");
      for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(count); ++i)
        mesh_.coordinates.push_back(number_at<Real>(bytes.data() + i * type->size, *type, std::endian::big));
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
    cells_.begins = integers(offset_count, offset_size, "an offset");
    text_.expect("CONNECTIVITY");
    const std::size_t corner_size = size_of(text_.word("the type of the corners"));
    if (corner_size != 4 && corner_size != 8) text_.fail("the corners must be of a four or eight byte integer type");
    read_corners(corner_count, corner_size);
    for (std::size_t i = 0; i < cells_.begins.size(); ++i)
      if (cells_.begins[i] < (i == 0 ? 0 : cells_.begins[i - 1]) || cells_.begins[i] > corner_count)
        text_.fail("cell " + std::to_string(i) + ": offset " + std::to_string(cells_.begins[i]) +
                   " is out of order or beyond the " + std::to_string(corner_count) + " corners");
  }

  void read_corners(std::int64_t count, std::size_t size) {
    if (binary_ && static_cast<std::size_t>(count) > text_.remaining() / size)
      text_.fail("the file ends within the corners of the cells");
    if (binary_) {
      cells_.corners = integers(count, size, "the corners");
      return;
    }
    for (std::int64_t i = 0; i < count; ++i) {
      cells_.corners.push_back(text_.integer("a corner"));
      cells_.lines.push_back(text_.line());
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
    cells_.begins.push_back(0);
    for (std::int64_t i = 0; i < cells; ++i) {
      text_.within("cell", i);
      if (binary_ && used >= size) text_.fail("the list of " + std::to_string(size) + " numbers ends before it");
      const std::int64_t corners = next("the number of corners");
      const std::int64_t room = binary_ ? size - used : static_cast<std::int64_t>(text_.remaining() / 2);
      if (corners < 0 || corners > room)
        text_.fail("the number of corners is " + std::to_string(corners) + ", the list has room for " +
                   std::to_string(room));
      for (std::int64_t k = 0; k < corners; ++k) {
        cells_.corners.push_back(next("a corner"));
        if (!binary_) cells_.lines.push_back(text_.line());
      }
      cells_.begins.push_back(static_cast<std::int64_t>(cells_.corners.size()));
    }
    text_.within({});
    if (binary_ && used != size)
      text_.fail("the cells take " + std::to_string(used) + " numbers, not the " + std::to_string(size) + " announced");
  }

  void read_types() {
    const std::int64_t announced = text_.integer("the number of cell types");
    const std::size_t cells = cells_.size();
    if (!binary_ && text_.peek().empty() && all_have_four_corners()) {  // Bullet's own samples end here
      for (std::size_t i = 0; i < cells; ++i) add_cell(10);
      return;
    }
    const std::int64_t count = text_.checked_count(announced, "the number of cell types", binary_ ? 4 : 1);
    if (static_cast<std::size_t>(count) != cells)
      text_.fail("there are " + std::to_string(count) + " cell types for " + std::to_string(cells) + " cells");
    std::vector<std::int64_t> binary_types;
    if (binary_) binary_types = integers(count, 4, "the cell types");
    for (std::size_t i = 0; i < cells; ++i) {
      text_.within("cell", static_cast<std::int64_t>(i));
      add_cell(binary_ ? binary_types[i] : text_.integer("the type"));
    }
  }

  void add_cell(std::int64_t type) {
    const std::string complaint = cells_.add(type, mesh_);
    if (!complaint.empty()) text_.fail(complaint);
  }

  bool all_have_four_corners() const {
    for (std::size_t i = 0; i + 1 < cells_.begins.size(); ++i)
      if (cells_.begins[i + 1] - cells_.begins[i] != 4) return false;
    return true;
  }

  // As far as it is known how long everything is.
  void read_data() {
    enum class On { nothing, points, cells } on = On::nothing;
    std::int64_t count = 0;
    const auto keep = [&](const VtkArray& array) {
      if (on != On::nothing) cells_.put_in_groups(array, on == On::cells, mesh_);
    };
    while (!text_.at_end()) {
      text_.within({});
      const std::string keyword = lower_case(text_.word("a section"));
      if (keyword == "cell_data" || keyword == "point_data") {
        on = keyword == "cell_data" ? On::cells : On::points;
        count = text_.integer("the number of values");
        const auto expected = static_cast<std::int64_t>(on == On::cells ? cells_.size() : mesh_.coordinates.size() / 3);
        if (count != expected)
          text_.fail("there is data for " + std::to_string(count) + (on == On::cells ? " cells" : " points") +
                     ", there are " + std::to_string(expected));
      } else if (keyword == "scalars") {
        const std::string name(text_.word("a name")), type(text_.word("a type"));
        const std::int64_t components = text_.at_line_end() ? 1 : text_.count("the number of components", 1);
        if (lower_case(text_.peek()) == "lookup_table") text_.word("LOOKUP_TABLE"), text_.word("the name of a table");
        const std::optional<VtkArray> array = read_array(name, components, count, type);
        if (!array) return;
        keep(*array);
      } else if (keyword == "field") {
        if (!read_field(on == On::nothing ? -1 : count, keep)) return;
      } else if (keyword == "vectors" || keyword == "normals" || keyword == "tensors" || keyword == "global_ids" ||
                 keyword == "pedigree_ids") {
        const std::string name(text_.word("a name")), type(text_.word("a type"));
        if (!read_array(name, keyword == "tensors" ? 9 : keyword.ends_with("ids") ? 1 : 3, count, type)) return;
      } else if (keyword == "metadata") {
        skip_metadata();
      } else {
        return;
      }
    }
  }

  template <class Keep>
  bool read_field(std::int64_t count, const Keep& keep) {
    text_.word("the name of the field");
    const std::int64_t arrays = text_.count("the number of arrays", 4);
    for (std::int64_t i = 0; i < arrays; ++i) {
      if (lower_case(text_.peek()) == "metadata") text_.word("METADATA"), skip_metadata();
      const std::string name(text_.word("the name of an array"));
      const std::int64_t components = text_.count("the number of components", 1);
      const std::int64_t tuples = text_.count("the number of tuples", 1);
      const std::string type(text_.word("the type of an array"));
      const std::optional<VtkArray> array = read_array(name, components, tuples, type);
      if (!array) return false;
      if (tuples == count) keep(*array);
    }
    return true;
  }

  // Values of arrays of one component; others are passed over. Nothing for a type whose size is not known.
  std::optional<VtkArray> read_array(const std::string& name, std::int64_t components, std::int64_t tuples,
                                     const std::string& type) {
    const std::string kind = lower_case(type);
    std::optional<NumberType> numbers = legacy_number_type(kind);
    if (numbers && kind == "vtkidtype") numbers->size = 4;  // ids are written as int
    if (!numbers && (binary_ || (kind != "bit" && kind != "string"))) return std::nullopt;
    if (components > 0 && tuples > static_cast<std::int64_t>(text_.remaining()) / components)
      text_.fail("the file ends within the array " + in_quotes(name));
    const bool is_integer = !numbers || numbers->sort != NumberType::Sort::floating;
    VtkArray array{.name = decoded(name), .is_integer = is_integer, .values = {}};
    const std::int64_t count = components * tuples;
    const bool is_kept = components == 1 && kind != "string";
    if (!binary_) {
      for (std::int64_t k = 0; k < count; ++k)
        if (is_kept)
          array.values.push_back(text_.real("a value"));
        else
          text_.word("a value");
      return array;
    }
    const std::string_view bytes = raw(count, numbers->size, "an array");
    for (std::size_t k = 0; is_kept && k < static_cast<std::size_t>(count); ++k)
      array.values.push_back(number_at<double>(bytes.data() + k * numbers->size, *numbers, std::endian::big));
    return array;
  }

  // Names have %20 for a space.
  static std::string decoded(std::string_view name) {
    std::string text;
    for (std::size_t i = 0; i < name.size(); ++i) {
      unsigned code = 0;
      if (name[i] == '%' && i + 2 < name.size() &&
          std::from_chars(name.data() + i + 1, name.data() + i + 3, code, 16).ptr == name.data() + i + 3) {
        text += static_cast<char>(code);
        i += 2;
      } else {
        text += name[i];
      }
    }
    return text;
  }

  // Names of components and the like, up to an empty line.
  void skip_metadata() {
    text_.rest_of_line();
    while (!text_.at_line_end()) text_.rest_of_line();
  }

  TextCursor text_;
  RawMesh mesh_;
  bool binary_ = false;
  VtkCells cells_;
};

}  // namespace

TetMesh read_vtk(const std::filesystem::path& path) {
  const std::string contents = load_file(path);
  const std::size_t first = contents.find_first_not_of(" \t\r\n");
  if (first != contents.npos && contents[first] == '<') return read_vtk_xml(path.string(), contents);
  return VtkReader(path.string(), contents).read();
}

}  // namespace penalty
