#include "read_ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "mesh_text.h"

namespace penalty {
namespace {

enum class Form { ascii, little_endian, big_endian };
enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

// Names are kept as messages may show them.
struct Property {
  std::string name;
  Type type{};
  bool is_list = false;
  Type count_type{};  // of a list
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

Type type_of(const TextCursor& text, std::string_view name) {
  constexpr std::pair<std::string_view, Type> names[] = {
      {"char", Type::int8},     {"int8", Type::int8},       {"uchar", Type::uint8},    {"uint8", Type::uint8},
      {"short", Type::int16},   {"int16", Type::int16},     {"ushort", Type::uint16},  {"uint16", Type::uint16},
      {"int", Type::int32},     {"int32", Type::int32},     {"uint", Type::uint32},    {"uint32", Type::uint32},
      {"float", Type::float32}, {"float32", Type::float32}, {"double", Type::float64}, {"float64", Type::float64}};
  for (const auto& [known, type] : names)
    if (name == known) return type;
  text.fail("unknown type " + in_quotes(name));
}

template <class T>
Real number(std::string_view bytes) {
  T value;
  std::copy_n(bytes.begin(), sizeof value, reinterpret_cast<char*>(&value));
  return static_cast<Real>(value);
}

class PlyReader {
 public:
  PlyReader(const std::string& file, std::string_view contents) : text_(file, contents) {}

  TriangleSurface read() {
    read_header();
    for (const Element& element : elements_)
      for (std::int64_t i = 0; i < element.count; ++i) {
        text_.within(element.name, i);
        read_element(element);
      }
    TriangleSurface surface;
    surface.source = text_.file();
    surface.vertices =
        Eigen::Map<const Eigen::Matrix3Xd>(coordinates_.data(), 3, static_cast<Eigen::Index>(coordinates_.size() / 3));
    surface.triangles = std::move(triangles_);
    return surface;
  }

 private:
  void read_header() {
    if (text_.rest_of_line() != "ply") text_.fail("not a PLY file: it does not begin with 'ply'");
    bool has_format = false;
    while (true) {
      const std::string_view keyword = text_.word("end_header");
      if (keyword == "end_header") break;
      if (keyword == "format") {
        read_format();
        has_format = true;
      } else if (keyword == "element") {
        Element element;
        element.name = printable(text_.word("the name of an element"));
        element.count = text_.count("the number of elements", 1);
        elements_.push_back(element);
      } else if (keyword == "property") {
        if (elements_.empty()) text_.fail("a property stands before the first element");
        read_property(elements_.back());
        continue;
      } else if (keyword != "comment" && keyword != "obj_info") {
        text_.fail("found " + in_quotes(keyword) + " in the header");
      }
      text_.rest_of_line();
    }
    text_.rest_of_line();
    if (!has_format) text_.fail("the header names no format");
    for (const Element& element : elements_) {
      // An element without properties takes no bytes: the size of the file would not bound the reading of its items.
      if (element.properties.empty() && element.count > 0)
        text_.fail("element " + in_quotes(element.name) + " has no properties");
      if (element.name != "vertex") continue;
      for (const char* axis : {"x", "y", "z"}) {
        const auto is_axis = [axis](const Property& property) { return property.name == axis && !property.is_list; };
        if (std::none_of(element.properties.begin(), element.properties.end(), is_axis))
          text_.fail(std::string("the vertices have no property ") + axis);
      }
    }
  }

  void read_format() {
    const std::string_view form = text_.word("the format");
    if (form == "ascii")
      form_ = Form::ascii;
    else if (form == "binary_little_endian")
      form_ = Form::little_endian;
    else if (form == "binary_big_endian")
      form_ = Form::big_endian;
    else
      text_.fail("unknown format " + in_quotes(form));
  }

  void read_property(Element& element) {
    Property property;
    std::string_view type = text_.word("the type of a property");
    if (type == "list") {
      property.is_list = true;
      property.count_type = type_of(text_, text_.word("the type of a count"));
      type = text_.word("the type of a property");
    }
    property.type = type_of(text_, type);
    property.name = printable(text_.word("the name of a property"));
    element.properties.push_back(property);
  }

  void read_element(const Element& element) {
    Vector3 place = Vector3::Constant(std::numeric_limits<Real>::quiet_NaN());
    for (const Property& property : element.properties) {
      if (!property.is_list) {
        const Real value = read_number(property.type, property.name);
        if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
          place[property.name[0] - 'x'] = value;
      } else {
        const bool is_face =
            element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index");
        read_list(property, is_face);
      }
    }
    if (element.name == "vertex") coordinates_.insert(coordinates_.end(), place.data(), place.data() + 3);
  }

  void read_list(const Property& property, bool is_face) {
    const std::int64_t count = read_integer(property.count_type, "the length of a list");
    if (count < 0) text_.fail("the length of a list is " + std::to_string(count));
    int first = 0, last = 0;
    for (std::int64_t k = 0; k < count; ++k) {
      if (!is_face) {
        read_number(property.type, property.name);
        continue;
      }
      const std::int64_t corner = read_integer(property.type, property.name);
      if (corner < 0 || corner > std::numeric_limits<int>::max())
        text_.fail("vertex index " + std::to_string(corner) + " is out of range");
      const int index = static_cast<int>(corner);
      if (k == 0) first = index;
      if (k >= 2) triangles_.push_back({first, last, index});
      last = index;
    }
  }

  std::int64_t read_integer(Type type, std::string_view what) {
    const Real value = read_number(type, what);
    if (!(std::abs(value) < 0x1p40) || value != std::floor(value))
      text_.fail(std::string(what) + " is " + to_text(value) + ", not a small integer");
    return static_cast<std::int64_t>(value);
  }

  Real read_number(Type type, std::string_view what) {
    if (form_ == Form::ascii) return text_.real(what);
    constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    std::string_view bytes = text_.bytes(sizes[static_cast<int>(type)], what);
    char turned[8];
    if ((form_ == Form::big_endian) != (std::endian::native == std::endian::big)) {
      for (std::size_t k = 0; k < bytes.size(); ++k) turned[k] = bytes[bytes.size() - 1 - k];
      bytes = {turned, bytes.size()};
    }
    switch (type) {
      case Type::int8:
        return number<std::int8_t>(bytes);
      case Type::uint8:
        return number<std::uint8_t>(bytes);
      case Type::int16:
        return number<std::int16_t>(bytes);
      case Type::uint16:
        return number<std::uint16_t>(bytes);
      case Type::int32:
        return number<std::int32_t>(bytes);
      case Type::uint32:
        return number<std::uint32_t>(bytes);
      case Type::float32:
        return number<float>(bytes);
      default:
        return number<double>(bytes);
    }
  }

  TextCursor text_;
  Form form_ = Form::ascii;
  std::vector<Element> elements_;
  std::vector<Real> coordinates_;
  std::vector<Triangle> triangles_;
};

}  // namespace

TriangleSurface read_ply(const std::string& file, std::string_view contents) {
  return PlyReader(file, contents).read();
}

}  // namespace penalty
