// VTK's XML files with an UnstructuredGrid: text, base64 and raw data, in the tags or appended, plain or from zlib.
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <pugixml.hpp>
#include <utility>

#include "raw_mesh.h"
#include "vtk_cells.h"
#include "vtk_numbers.h"

namespace penalty {
namespace {

enum class Encoding { raw, base64 };

// Bytes in the order in which they were encoded.
class ByteStream {
 public:
  ByteStream(std::string_view text, Encoding encoding) : text_(text), encoding_(encoding) {}

  std::size_t remaining() const {  // at most
    return encoding_ == Encoding::raw ? text_.size() : pending_.size() + text_.size() / 4 * 3;
  }

  // The next `count` bytes; nothing if the text ends before.
  std::optional<std::string> take(std::size_t count) {
    if (count > remaining()) return std::nullopt;
    if (encoding_ == Encoding::raw) {
      std::string bytes(text_.substr(0, count));
      text_.remove_prefix(count);
      return bytes;
    }
    std::string bytes = std::exchange(pending_, {});
    bytes.reserve(count + 3);
    while (bytes.size() < count)
      if (!decode_group(bytes)) return std::nullopt;
    pending_ = bytes.substr(count);
    bytes.resize(count);
    return bytes;
  }

 private:
  // Appends what four characters stand for. A stream that ends with '=' may be followed by another one.
  bool decode_group(std::string& bytes) {
    std::uint32_t bits = 0;
    int digits = 0, padding = 0;
    while (digits + padding < 4) {
      if (text_.empty()) return false;
      const char c = text_.front();
      text_.remove_prefix(1);
      if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
      const int digit = c >= 'A' && c <= 'Z'   ? c - 'A'
                        : c >= 'a' && c <= 'z' ? c - 'a' + 26
                        : c >= '0' && c <= '9' ? c - '0' + 52
                        : c == '+'             ? 62
                        : c == '/'             ? 63
                                               : -1;
      if (digit >= 0 && padding == 0) {
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        ++digits;
      } else if (c == '=' && digits >= 2) {
        bits <<= 6;
        ++padding;
      } else {
        return false;
      }
    }
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(bits >> (16 - 8 * k) & 0xff);
    return true;
  }

  std::string_view text_;
  Encoding encoding_;
  std::string pending_;  // decoded, not yet taken
};

// Int8 to UInt64, Float32 and Float64.
std::optional<NumberType> xml_number_type(std::string_view name) {
  using Sort = NumberType::Sort;
  for (const auto& [prefix, sort] :
       {std::pair("Float", Sort::floating), std::pair("UInt", Sort::natural), std::pair("Int", Sort::whole)}) {
    if (!name.starts_with(prefix)) continue;
    const std::string_view bits = name.substr(std::strlen(prefix));
    for (const std::size_t size : {1u, 2u, 4u, 8u})
      if (bits == std::to_string(8 * size) && (sort != Sort::floating || size >= 4)) return NumberType{sort, size};
  }
  return std::nullopt;
}

// zlib makes a byte of no more than 1032.
constexpr std::uint64_t most_inflated(std::uint64_t size) { return 1032 * size + 64; }

class VtkXmlReader {
 public:
  VtkXmlReader(std::string file, std::string_view contents) : file_(std::move(file)), contents_(contents) {
    mesh_.origin.vertex_file = mesh_.origin.tetrahedron_file = file_;
  }

  TetMesh read() {
    parse();
    const pugi::xml_node grid = child(root_, "UnstructuredGrid");
    for (const pugi::xml_node piece : grid.children("Piece")) read_piece(piece);
    if (!grid.child("Piece")) fail(grid, "there is no Piece");
    for (const bool of_cells : {true, false})
      for (const Data& data : of_cells ? cell_data_ : point_data_)
        if (data.num_pieces == num_pieces_) cells_.put_in_groups(data.array, of_cells, mesh_);
    return std::move(mesh_).finish(file_);
  }

 private:
  struct Data {
    VtkArray array;
    int num_pieces;  // that have it
  };

  int line_of(std::size_t offset) const {
    return 1 + static_cast<int>(
                   std::count(contents_.begin(), contents_.begin() + static_cast<std::ptrdiff_t>(offset), '\n'));
  }
  [[noreturn]] void fail_at(std::ptrdiff_t offset, std::string_view message) const {
    const auto place = std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0)), contents_.size());
    throw MeshError(file_ + ":" + std::to_string(line_of(place)) + ": " + std::string(message));
  }
  [[noreturn]] void fail(pugi::xml_node node, std::string_view message) const { fail_at(node.offset_debug(), message); }

  // What is appended need not be XML: the text ends before it.
  void parse() {
    std::string_view text = contents_;
    std::string closed;
    const std::size_t appended = contents_.find("<AppendedData");
    if (appended != contents_.npos) {
      closed = std::string(contents_.substr(0, appended)) + "</VTKFile>";
      text = closed;
      const std::size_t tag_end = contents_.find('>', appended), begin = contents_.find('_', tag_end);
      if (begin == contents_.npos) fail_at(static_cast<std::ptrdiff_t>(appended), "AppendedData without its '_'");
      appended_ = contents_.substr(begin + 1);
      const std::string_view tag = contents_.substr(appended, tag_end - appended);
      appended_encoding_ = tag.find("base64") == tag.npos ? Encoding::raw : Encoding::base64;
    }
    const pugi::xml_parse_result result =
        document_.load_buffer(text.data(), text.size(), pugi::parse_minimal, pugi::encoding_utf8);
    if (result.status == pugi::status_out_of_memory) throw std::bad_alloc();
    if (!result) fail_at(result.offset, std::string("not well-formed XML: ") + result.description());
    root_ = document_.child("VTKFile");
    if (!root_) fail_at(0, "not a file of VTK: there is no VTKFile");
    const std::string_view type = root_.attribute("type").value();
    if (type != "UnstructuredGrid")
      fail(root_, "the data set is " + in_quotes(type) + ", not UnstructuredGrid" +
                      (type.starts_with('P') && type != "PolyData" ? ": read its pieces, or save it as one" : ""));
    const std::string_view compressor = root_.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail(root_, "compressed by " + in_quotes(compressor) + ": save it with zlib or uncompressed");
    is_compressed_ = !compressor.empty();
    header_size_ = std::string_view(root_.attribute("header_type").value()) == "UInt64" ? 8 : 4;
    const bool is_big = std::string_view(root_.attribute("byte_order").value()) == "BigEndian";
    order_ = is_big ? std::endian::big : std::endian::little;
  }

  pugi::xml_node child(pugi::xml_node parent, const char* name) const {
    const pugi::xml_node found = parent.child(name);
    if (!found) fail(parent, std::string("there is no ") + name);
    return found;
  }

  // -1 if there is none.
  std::int64_t integer(pugi::xml_node node, const char* attribute) const {
    TextCursor text(file_, node.attribute(attribute).value(), '\0',
                    line_of(static_cast<std::size_t>(node.offset_debug())));
    return text.at_end() ? -1 : text.integer(attribute);
  }

  std::int64_t count(pugi::xml_node node, const char* attribute) const {
    const std::int64_t value = integer(node, attribute);
    if (value < 0 || value >= std::numeric_limits<int>::max())
      fail(node, std::string(attribute) + " is " + in_quotes(node.attribute(attribute).value()) + ", must be a count");
    return value;
  }

  void read_piece(pugi::xml_node piece) {
    const std::int64_t points = count(piece, "NumberOfPoints"), cells = count(piece, "NumberOfCells");
    const auto first_vertex = static_cast<std::int64_t>(mesh_.coordinates.size() / 3);
    const std::size_t first_cell = cells_.size();
    if (points > 0) {
      const auto coordinates = values<Real>(child(child(piece, "Points"), "DataArray"), 3 * points);
      mesh_.coordinates.insert(mesh_.coordinates.end(), coordinates.begin(), coordinates.end());
    }
    if (cells > 0) {
      const pugi::xml_node lists = child(piece, "Cells");
      const auto named = [&](const char* name) {
        const pugi::xml_node array = lists.find_child_by_attribute("DataArray", "Name", name);
        if (!array) fail(lists, std::string("there is no array ") + in_quotes(name));
        return array;
      };
      const auto ends = values<std::int64_t>(named("offsets"), cells);
      const auto types = values<std::int64_t>(named("types"), cells);
      for (std::size_t i = 0; i < ends.size(); ++i)
        if (ends[i] < (i == 0 ? 0 : ends[i - 1]) || ends[i] >= std::numeric_limits<int>::max())
          fail(named("offsets"),
               "cell " + std::to_string(i) + ": offset " + std::to_string(ends[i]) + " is out of order");
      const auto corners = values<std::int64_t>(named("connectivity"), ends.back());
      const auto first_corner = static_cast<std::int64_t>(cells_.corners.size());
      for (std::size_t k = 0; k < corners.size(); ++k) {
        if (corners[k] < 0 || corners[k] >= points)
          fail(named("connectivity"), "corner " + std::to_string(k) + " is vertex " + std::to_string(corners[k]) +
                                          ", there are " + std::to_string(points));
        cells_.corners.push_back(first_vertex + corners[k]);
      }
      if (cells_.begins.empty()) cells_.begins.push_back(0);
      for (const std::int64_t end : ends) cells_.begins.push_back(first_corner + end);
      for (std::size_t i = 0; i < types.size(); ++i) {
        const std::string complaint = cells_.add(types[i], mesh_);
        if (!complaint.empty()) fail(named("types"), "cell " + std::to_string(i) + ": " + complaint);
      }
    }
    keep(piece.child("CellData"), cells_.size() - first_cell, cell_data_);
    keep(piece.child("PointData"), static_cast<std::size_t>(points), point_data_);
    ++num_pieces_;
  }

  // Arrays of one number each, joined with those of the pieces before.
  void keep(pugi::xml_node data, std::size_t size, std::vector<Data>& kept) {
    for (const pugi::xml_node array : data.children("DataArray")) {
      const std::optional<NumberType> type = xml_number_type(array.attribute("type").value());
      const std::string_view components = array.attribute("NumberOfComponents").value();
      if (!type || !(components.empty() || components == "1" || components == "0")) continue;
      const std::string name = array.attribute("Name").value();
      const auto found =
          std::find_if(kept.begin(), kept.end(), [&](const Data& other) { return other.array.name == name; });
      if (found == kept.end() ? num_pieces_ > 0 : found->num_pieces != num_pieces_) continue;
      const bool is_whole = type->sort != NumberType::Sort::floating;
      Data& target = found == kept.end() ? kept.emplace_back(Data{VtkArray{name, is_whole, {}}, 0}) : *found;
      const auto more = values<double>(array, static_cast<std::int64_t>(size));
      target.array.is_integer = target.array.is_integer && is_whole;
      target.array.values.insert(target.array.values.end(), more.begin(), more.end());
      ++target.num_pieces;
    }
  }

  // All `count` values of an array.
  template <class T>
  std::vector<T> values(pugi::xml_node array, std::int64_t count) {
    const std::string name = "array " + in_quotes(array.attribute("Name").value());
    const std::optional<NumberType> type = xml_number_type(array.attribute("type").value());
    if (!type || (std::is_same_v<T, std::int64_t> && type->sort == NumberType::Sort::floating))
      fail(array, name + ": type " + in_quotes(array.attribute("type").value()) + " is not read");
    const std::string_view format = array.attribute("format").value();
    std::vector<T> numbers;
    if (format == "appended") {
      const std::int64_t at = integer(array, "offset");
      if (at < 0 || static_cast<std::size_t>(at) > appended_.size())
        fail(array, name + ": offset " + in_quotes(array.attribute("offset").value()) + " is not in the appended data");
      decode(array, name, ByteStream(appended_.substr(static_cast<std::size_t>(at)), appended_encoding_), *type, count,
             numbers);
      return numbers;
    }
    pugi::xml_node text = array.first_child();
    while (text && text.type() != pugi::node_pcdata) text = text.next_sibling();
    const std::size_t begin = text ? static_cast<std::size_t>(text.offset_debug()) : 0;
    const std::string_view written = text ? contents_.substr(begin, std::strlen(text.value())) : std::string_view();
    if (format == "binary") {
      decode(array, name, ByteStream(written, Encoding::base64), *type, count, numbers);
      return numbers;
    }
    if (format != "ascii" && !format.empty()) fail(array, name + ": format " + in_quotes(format) + " is not read");
    TextCursor words(file_, written, '\0', line_of(begin));
    words.checked_count(count, "the size of " + name, 2);
    numbers.reserve(static_cast<std::size_t>(count));
    for (std::int64_t k = 0; k < count; ++k) {
      if (words.at_end())
        fail(array, name + ": ends after " + std::to_string(k) + " of " + std::to_string(count) + " numbers");
      if constexpr (std::is_same_v<T, std::int64_t>)
        numbers.push_back(words.integer("a number of " + name));
      else
        numbers.push_back(words.real("a number of " + name));
    }
    return numbers;
  }

  template <class T>
  void decode(pugi::xml_node array, const std::string& name, ByteStream stream, NumberType type, std::int64_t count,
              std::vector<T>& numbers) {
    const std::uint64_t wanted = static_cast<std::uint64_t>(count) * type.size;
    num_decoded_ += wanted;
    if (num_decoded_ > (is_compressed_ ? most_inflated(contents_.size()) : 2 * contents_.size()))
      fail(array, name + ": with it there is more data than the file can hold");
    const std::string bytes =
        is_compressed_ ? inflated(array, name, stream, wanted) : plain(array, name, stream, wanted);
    numbers.reserve(static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
      numbers.push_back(number_at<T>(bytes.data() + k * type.size, type, order_));
  }

  std::string take(pugi::xml_node array, const std::string& name, ByteStream& stream, std::uint64_t size) const {
    std::optional<std::string> bytes = stream.take(size);
    if (!bytes) fail(array, name + ": the data ends early or is not encoded as it should be");
    return *std::move(bytes);
  }
  std::uint64_t take_header(pugi::xml_node array, const std::string& name, ByteStream& stream) const {
    return number_at<std::uint64_t>(take(array, name, stream, header_size_).data(),
                                    NumberType{NumberType::Sort::natural, header_size_}, order_);
  }
  [[noreturn]] void fail_size(pugi::xml_node array, const std::string& name, std::uint64_t size,
                              std::uint64_t wanted) const {
    fail(array, name + ": " + std::to_string(size) + " bytes, not " + std::to_string(wanted));
  }

  std::string plain(pugi::xml_node array, const std::string& name, ByteStream& stream, std::uint64_t wanted) const {
    const std::uint64_t size = take_header(array, name, stream);
    if (size != wanted) fail_size(array, name, size, wanted);
    return take(array, name, stream, size);
  }

  // Blocks, each inflated by itself. Before them: how many there are, their size, that of the last if it is another (else 0),
  // and the compressed size of each.
  std::string inflated(pugi::xml_node array, const std::string& name, ByteStream& stream, std::uint64_t wanted) const {
    const std::uint64_t blocks = take_header(array, name, stream);
    if (blocks == 0 && wanted == 0) return {};
    const std::uint64_t block_size = take_header(array, name, stream), last_size = take_header(array, name, stream);
    if (blocks > stream.remaining() / header_size_)
      fail(array, name + ": " + std::to_string(blocks) + " blocks, more than the data can hold");
    std::vector<std::uint64_t> sizes(blocks);
    for (std::uint64_t& size : sizes) size = take_header(array, name, stream);
    std::string bytes;
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      const std::uint64_t full = k + 1 == sizes.size() && last_size > 0 ? last_size : block_size;
      if (full > wanted - bytes.size() || sizes[k] > stream.remaining() || full > most_inflated(sizes[k]))
        fail(array, name + ": block " + std::to_string(k) + " of " + std::to_string(full) + " bytes is too large");
      const std::string packed = take(array, name, stream, sizes[k]);
      const std::size_t begin = bytes.size();
      bytes.resize(begin + full);
      uLongf size = static_cast<uLongf>(full);
      const int status = uncompress(reinterpret_cast<Bytef*>(bytes.data() + begin), &size,
                                    reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size()));
      if (status == Z_MEM_ERROR) throw std::bad_alloc();
      if (status != Z_OK || size != full) fail(array, name + ": block " + std::to_string(k) + " cannot be inflated");
    }
    if (bytes.size() != wanted) fail_size(array, name, bytes.size(), wanted);
    return bytes;
  }

  std::string file_;
  std::string_view contents_, appended_;
  Encoding appended_encoding_ = Encoding::raw;
  pugi::xml_document document_;
  pugi::xml_node root_;
  bool is_compressed_ = false;
  std::endian order_ = std::endian::little;
  std::size_t header_size_ = 4;
  std::uint64_t num_decoded_ = 0;  // [bytes] of all arrays, which might all claim the same data
  RawMesh mesh_;
  VtkCells cells_;
  int num_pieces_ = 0;
  std::vector<Data> cell_data_, point_data_;
};

}  // namespace

TetMesh read_vtk_xml(const std::string& file, std::string_view contents) { return VtkXmlReader(file, contents).read(); }

}  // namespace penalty
