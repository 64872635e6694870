// Gmsh .msh of versions 1, 2, 4.0 and 4.1, ASCII and binary.
#include <algorithm>
#include <array>
#include <bit>

#include "gmsh_elements.h"
#include "gmsh_groups.h"
#include "raw_mesh.h"

namespace penalty {
namespace {

enum class Layout { unknown, one, two, four_zero, four_one };

// More groups an entity than this make a small file a large mesh.
constexpr std::int64_t most_physicals = 100;

class GmshReader {
 public:
  GmshReader(std::string file, std::string_view contents) : text_(std::move(file), contents) {
    mesh_.origin.vertex_file = mesh_.origin.tetrahedron_file = text_.file();
  }

  TetMesh read() {
    bool nodes = false, elements = false;
    while (!(nodes && elements)) {  // later sections hold data, names, partitions
      if (text_.at_end()) text_.fail(std::string("the section ") + (nodes ? "$Elements" : "$Nodes") + " is missing");
      const std::string_view section = text_.word("a section");
      if (!section.starts_with('$') || section.starts_with("$End"))
        text_.fail("found " + in_quotes(section) + " where a section should begin");
      if (section == "$MeshFormat") {
        read_format();
      } else if (section == "$PhysicalNames") {
        read_names();
      } else if (section == "$Entities") {
        require_format(section);
        read_entities();
      } else if (!nodes && (section == "$Nodes" || section == "$NOD")) {
        require_format(section);
        read_nodes();
        nodes = true;
      } else if (!elements && (section == "$Elements" || section == "$ELM")) {
        require_format(section);
        read_elements();
        elements = true;
      } else {
        skip(section);
        continue;
      }
      text_.expect(end_of(section));
    }
    groups_.finish();
    const std::string source = text_.file();
    return std::move(mesh_).finish(source);
  }

 private:
  static std::string end_of(std::string_view section) {
    const bool is_old = section == "$NOD" || section == "$ELM";
    return std::string(is_old ? "$END" : "$End").append(section.substr(1));
  }

  void skip(std::string_view section) {
    const std::string end = end_of(section);
    text_.rest_of_line();
    while (text_.rest_of_line() != end)
      if (text_.at_end()) text_.fail("the file ends within the section " + in_quotes(section));
  }

  void require_format(std::string_view section) {
    if (section == "$NOD" || section == "$ELM")
      layout_ = Layout::one;
    else if (layout_ == Layout::unknown)
      text_.fail("found " + in_quotes(section) + " before $MeshFormat, which says how to read it");
  }

  void read_format() {
    const std::string_view version = text_.word("the version");
    if (version == "2" || version.starts_with("2."))
      layout_ = Layout::two;
    else if (version == "4" || version == "4.0")
      layout_ = Layout::four_zero;
    else if (version == "4.1")
      layout_ = Layout::four_one;
    else
      text_.fail("version " + in_quotes(version) +
                 " is none of 1, 2.x, 4.0 and 4.1: write another with gmsh -save -format msh41");
    const std::int64_t type = text_.integer("the file type");
    if (type != 0 && type != 1)
      text_.fail("the file type is " + std::to_string(type) + ", not 0 (ASCII) or 1 (binary)");
    text_.rest_of_line();
    if (type == 1) read_byte_order();
  }

  // After its heading a binary file has the number one.
  void read_byte_order() {
    is_binary_ = true;
    const auto one = raw<std::int32_t>("the byte order");
    is_swapped_ = one != 1;
    if (one != 1 && one != 0x01000000)
      text_.fail("the byte order is " + std::to_string(one) + ", not 1 in either order");
  }

  template <class T>
  T raw(std::string_view what) {
    const std::string_view found = text_.bytes(sizeof(T), what);
    std::array<char, sizeof(T)> bytes;
    std::copy(found.begin(), found.end(), bytes.begin());
    if (is_swapped_) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }

  // The numbers of a section: what the manual calls int, size_t (unsigned long in 4.0) and double.
  std::int64_t integer(std::string_view what) { return is_binary_ ? raw<std::int32_t>(what) : text_.integer(what); }
  std::int64_t size(std::string_view what) { return is_binary_ ? raw<std::int64_t>(what) : text_.integer(what); }
  Real real(std::string_view what) { return is_binary_ ? raw<double>(what) : text_.real(what); }

  // How many items there are, each of that many bytes in a text or in a binary file.
  std::int64_t count(std::string_view what, std::size_t in_text, std::size_t in_binary) {
    return text_.checked_count(size(what), what, is_binary_ ? in_binary : in_text);
  }

  // dimension, number, name in quotes; as text in binary files, too
  void read_names() {
    const std::int64_t names = text_.count("the number of names", 6);
    for (std::int64_t i = 0; i < names; ++i) {
      text_.within("physical name", i);
      const std::int64_t dimension = text_.integer("the dimension"), number = text_.integer("the number of the group");
      std::string_view name = text_.rest_of_line();
      if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
      groups_.set_name(dimension, number, name);
    }
    text_.within({});
  }

  // Points, curves, surfaces and volumes of the model: number, box, physical groups, boundary.
  void read_entities() {
    begin_section();
    std::array<std::int64_t, 4> numbers;
    for (std::int64_t& number : numbers) number = count("the number of entities", 8, 20);
    for (int dimension = 0; dimension < 4; ++dimension)
      for (std::int64_t i = 0; i < numbers[dimension]; ++i) {
        text_.within("entity", i);
        const std::int64_t entity = integer("the number of the entity");
        const bool is_place = dimension == 0 && layout_ == Layout::four_one;
        for (int k = 0; k < (is_place ? 3 : 6); ++k) real("the box of the entity");
        const std::int64_t physicals = count("the number of physical groups", 2, 4);
        if (physicals > most_physicals)
          text_.fail("it is in " + std::to_string(physicals) + " physical groups, more than " +
                     std::to_string(most_physicals));
        for (std::int64_t k = 0; k < physicals; ++k)
          groups_.put_entity_in(dimension, entity, integer("a physical group"));
        if (dimension == 0) continue;
        const std::int64_t sides = count("the number of entities around it", 2, 4);
        for (std::int64_t k = 0; k < sides; ++k) integer("an entity around it");
      }
    text_.within({});
  }

  void begin_section() {
    if (is_binary_) text_.rest_of_line();
  }

  void read_nodes() {
    begin_section();
    if (layout_ == Layout::one || layout_ == Layout::two) {
      const std::int64_t nodes = text_.count("the number of nodes", 8);
      begin_section();
      add_nodes(nodes, 0);
    } else {
      const std::int64_t blocks = count("the number of node blocks", 8, 20);
      for (int k = 0; k < (layout_ == Layout::four_one ? 3 : 1); ++k) size("a total");  // the blocks say the same
      for (std::int64_t block = 0; block < blocks; ++block) {
        text_.within("node block", block);
        const std::int64_t first = integer("the entity"), second = integer("the entity");  // dimension and tag
        const std::int64_t dimension = layout_ == Layout::four_one ? first : second;
        const bool is_parametric = integer("the parametric flag") != 0;
        const std::int64_t nodes = count("the number of nodes", 8, 28);
        const std::int64_t parameters = is_parametric ? dimension : 0;
        if (parameters < 0 || parameters > 3)
          text_.fail("the entity dimension is " + std::to_string(parameters) + ", not 0 to 3");
        layout_ == Layout::four_one ? add_tagged_nodes(nodes, parameters) : add_nodes(nodes, parameters);
      }
    }
    text_.within({});
  }

  void add_nodes(std::int64_t nodes, std::int64_t parameters) {
    for (std::int64_t i = 0; i < nodes; ++i) {
      text_.within("node", i);
      const std::int64_t tag = integer("the number of the node");
      mesh_.origin.vertex_tags.push_back(tag);
      add_vertex(tag, parameters);
    }
  }

  // All tags, then all places.
  void add_tagged_nodes(std::int64_t nodes, std::int64_t parameters) {
    const std::size_t first = mesh_.origin.vertex_tags.size();
    for (std::int64_t i = 0; i < nodes; ++i) mesh_.origin.vertex_tags.push_back(size("a node tag"));
    for (std::int64_t i = 0; i < nodes; ++i)
      add_vertex(mesh_.origin.vertex_tags[first + static_cast<std::size_t>(i)], parameters);
  }

  void add_vertex(std::int64_t tag, std::int64_t parameters) {
    text_.within("vertex", tag);
    if (is_binary_)
      for (int axis = 0; axis < 3; ++axis) mesh_.coordinates.push_back(real("a coordinate"));
    else
      mesh_.add_vertex(text_);
    for (std::int64_t k = 0; k < parameters; ++k) real("a parameter");
  }

  void read_elements() {
    begin_section();
    switch (layout_) {
      case Layout::unknown:  // `require_format` has seen to that
      case Layout::one:
      case Layout::two:
        is_binary_ ? read_elements_in_runs() : read_elements_in_lines();
        break;
      case Layout::four_zero:
      case Layout::four_one:
        read_elements_in_blocks();
        break;
    }
    text_.within({});
  }

  // tag, type, tags, nodes
  void read_elements_in_lines() {
    const std::int64_t elements = text_.count("the number of elements", 6);
    for (std::int64_t i = 0; i < elements; ++i) {
      text_.within("element", i);
      const std::int64_t tag = text_.integer("the number of the element");
      text_.within("element", tag);
      const GmshElement type = read_type();
      if (type.nodes == 0) refuse_type();
      const std::int64_t tags = layout_ == Layout::one ? 3 : text_.integer("the number of tags");
      const std::array<std::int64_t, 2> groups = read_tags(tags);
      add_element(type, tag, 4);
      put_in(type, groups);
    }
  }

  // The physical group and the entity come first; in version 1 the number of nodes is the last of three.
  std::array<std::int64_t, 2> read_tags(std::int64_t tags) {
    std::array<std::int64_t, 2> groups{};
    for (std::int64_t k = 0; k < tags; ++k) {
      const std::int64_t value = integer("a tag");
      if (k < 2) groups[k] = value;
    }
    return groups;
  }

  void put_in(const GmshElement& type, const std::array<std::int64_t, 2>& groups) {
    groups_.put_in(type.dimension, groups[0], nodes_);
    if (type.solid) groups_.put_in_entity(3, groups[1], nodes_);
  }

  // Runs of elements of one type, each run after its type, size and number of tags.
  void read_elements_in_runs() {
    const std::int64_t elements = text_.count("the number of elements", 8);
    begin_section();
    for (std::int64_t read = 0; read < elements;) {
      text_.within("element", read);
      const GmshElement type = read_type();
      const std::int64_t run = integer("the number of elements of this type"), tags = integer("the number of tags");
      if (run <= 0 || run > elements - read)
        text_.fail("a run of " + std::to_string(run) + " elements, where " + std::to_string(elements - read) +
                   " are left");
      if (type.nodes == 0) refuse_type();
      if (tags < 0) text_.fail("the number of tags is " + std::to_string(tags) + ", below zero");
      for (std::int64_t i = 0; i < run; ++i, ++read) {
        const std::int64_t tag = integer("the number of the element");
        text_.within("element", tag);
        const std::array<std::int64_t, 2> groups = read_tags(tags);
        add_element(type, tag, 4);
        put_in(type, groups);
      }
    }
  }

  void read_elements_in_blocks() {
    const bool is_four_one = layout_ == Layout::four_one;
    const std::int64_t blocks = count("the number of element blocks", 8, 20);
    for (int k = 0; k < (is_four_one ? 3 : 1); ++k) size("a total");
    for (std::int64_t block = 0; block < blocks; ++block) {
      text_.within("element block", block);
      const std::int64_t first = integer("the entity"), second = integer("the entity");  // dimension and tag
      const std::int64_t entity = is_four_one ? second : first;
      const GmshElement type = read_type();
      const std::int64_t elements = count("the number of elements", 4, 8);
      if (type.nodes == 0 && elements > 0) refuse_type();
      for (std::int64_t i = 0; i < elements; ++i) {
        const std::int64_t tag = is_four_one ? size("the number of the element") : integer("the number of the element");
        text_.within("element", tag);
        add_element(type, tag, is_four_one ? 8 : 4);
        groups_.put_in_entity(type.dimension, entity, nodes_);
      }
    }
  }

  GmshElement read_type() { return gmsh_element(type_ = integer("the element type")); }

  [[noreturn]] void refuse_type() const {
    text_.fail("element type " + std::to_string(type_) + " is not read: save the mesh with elements of first order");
  }

  // Reads the nodes of an element, those of a solid as far as its corners; in a binary file each has so many bytes.
  void add_element(const GmshElement& type, std::int64_t tag, std::size_t bytes) {
    const auto size = static_cast<std::size_t>(type.nodes),
               corners = type.solid ? static_cast<std::size_t>(*type.solid) : size;
    nodes_.clear();
    for (std::size_t k = 0; k < corners; ++k)
      nodes_.push_back(bytes == 8 ? this->size("a corner") : integer("a corner"));
    if (type.solid) {
      mesh_.add(*type.solid, nodes_, tag, is_binary_ ? 0 : text_.line());
      if (size > corners) mesh_.count_reduced();
    } else {
      mesh_.count_skipped();
    }
    if (is_binary_)
      text_.bytes(bytes * (size - corners), "the nodes of an element");
    else
      text_.rest_of_line();
  }

  TextCursor text_;
  RawMesh mesh_;
  Layout layout_ = Layout::unknown;
  GmshGroups groups_{mesh_};
  std::int64_t type_ = 0;            // of the element read last
  std::vector<std::int64_t> nodes_;  // its corners
  bool is_binary_ = false, is_swapped_ = false;
};

}  // namespace

TetMesh read_gmsh(const std::filesystem::path& path) {
  const std::string contents = load_file(path);
  return GmshReader(path.string(), contents).read();
}

}  // namespace penalty
