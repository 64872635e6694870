// Gmsh .msh 2.x and 4.1, ASCII.
#include "raw_mesh.h"

namespace penalty {
namespace {

enum class Layout { two, four_one };

enum class Element { tetrahedron, lower_dimension, other_solid };

// Element types of the Gmsh manual, section "MSH file format". Second-order tetrahedra list their corners first.
Element element_of(std::int64_t type) {
  switch (type) {
    case 4:
    case 11:
    case 29:
    case 30:
    case 31:  // of order 1 to 5
      return Element::tetrahedron;
    case 1:
    case 2:
    case 3:
    case 8:
    case 9:
    case 10:
    case 15:
    case 16:
    case 20:
    case 21:
    case 22:
    case 23:
    case 24:
    case 25:
    case 26:
    case 27:
    case 28:
      return Element::lower_dimension;
    default:
      return Element::other_solid;
  }
}

[[noreturn]] void refuse_solid(const TextCursor& text, std::int64_t type) {
  std::string name;
  if (type == 5 || type == 12 || type == 17) name = " (hexahedron)";
  if (type == 6 || type == 13 || type == 18) name = " (prism)";
  if (type == 7 || type == 14 || type == 19) name = " (pyramid)";
  text.fail("element type " + std::to_string(type) + name + " is not a tetrahedron");
}

Layout read_format(TextCursor& text) {
  if (text.word("$MeshFormat") != "$MeshFormat") text.fail("not a Gmsh mesh of version 2 or 4: $MeshFormat is missing");
  const std::string_view version = text.word("the version");
  const bool two = version == "2" || version.starts_with("2.");
  if (!two && version != "4.1") text.fail("version " + in_quotes(version) + " is neither 2.x nor 4.1");
  const std::int64_t binary = text.integer("the file type");
  if (binary != 0) text.fail("binary Gmsh files are not read: save it as ASCII");
  text.rest_of_line();
  text.expect("$EndMeshFormat");
  return two ? Layout::two : Layout::four_one;
}

void read_nodes_2(TextCursor& text, RawMesh& mesh) {
  const std::int64_t count = text.count("the number of nodes", 8);
  for (std::int64_t i = 0; i < count; ++i) {
    text.within("node", i);
    const std::int64_t tag = text.integer("the number of the node");
    text.within("vertex", tag);
    mesh.origin.vertex_tags.push_back(tag);
    mesh.add_vertex(text);
  }
  text.within({});
}

void read_elements_2(TextCursor& text, RawMesh& mesh) {
  const std::int64_t count = text.count("the number of elements", 6);
  for (std::int64_t i = 0; i < count; ++i) {
    text.within("element", i);
    const std::int64_t tag = text.integer("the number of the element");
    text.within("element", tag);
    const std::int64_t type = text.integer("the element type");
    const Element element = element_of(type);
    if (element == Element::other_solid) refuse_solid(text, type);
    if (element == Element::tetrahedron) {
      const std::int64_t tags = text.integer("the number of tags");
      for (std::int64_t k = 0; k < tags; ++k) text.word("a tag");
      mesh.add_tetrahedron(text, tag);
    }
    text.rest_of_line();
  }
  text.within({});
}

void read_nodes_41(TextCursor& text, RawMesh& mesh) {
  const std::int64_t blocks = text.count("the number of node blocks", 8);
  text.rest_of_line();  // totals: the blocks say the same
  for (std::int64_t block = 0; block < blocks; ++block) {
    text.within("node block", block);
    const std::int64_t dimension = text.integer("the entity dimension");
    text.integer("the entity tag");
    const std::int64_t parameters = text.integer("the parametric flag") != 0 ? dimension : 0;
    const std::int64_t count = text.count("the number of nodes", 8);
    const std::size_t first = mesh.origin.vertex_tags.size();
    for (std::int64_t i = 0; i < count; ++i) mesh.origin.vertex_tags.push_back(text.integer("a node tag"));
    for (std::int64_t i = 0; i < count; ++i) {
      text.within("vertex", mesh.origin.vertex_tags[first + static_cast<std::size_t>(i)]);
      mesh.add_vertex(text);
      for (std::int64_t k = 0; k < parameters; ++k) text.real("a parameter");
    }
  }
  text.within({});
}

void read_elements_41(TextCursor& text, RawMesh& mesh) {
  const std::int64_t blocks = text.count("the number of element blocks", 8);
  text.rest_of_line();
  for (std::int64_t block = 0; block < blocks; ++block) {
    text.within("element block", block);
    text.integer("the entity dimension");
    text.integer("the entity tag");
    const std::int64_t type = text.integer("the element type");
    const std::int64_t count = text.count("the number of elements", 4);
    const Element element = element_of(type);
    if (element == Element::other_solid && count > 0) refuse_solid(text, type);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t tag = text.integer("the number of the element");
      text.within("element", tag);
      if (element == Element::tetrahedron) mesh.add_tetrahedron(text, tag);
      text.rest_of_line();
    }
  }
  text.within({});
}

}  // namespace

TetMesh read_gmsh(const std::filesystem::path& path) {
  const std::string contents = load_file(path);
  TextCursor text(path.string(), contents);
  RawMesh mesh;
  mesh.origin.vertex_file = mesh.origin.tetrahedron_file = text.file();
  const Layout layout = read_format(text);
  bool nodes = false, elements = false;
  while (!(nodes && elements)) {  // later sections hold data, names, partitions
    if (text.at_end()) text.fail(nodes ? "the section $Elements is missing" : "the section $Nodes is missing");
    const std::string_view section = text.word("a section");
    if (section == "$Nodes" && !nodes) {
      layout == Layout::two ? read_nodes_2(text, mesh) : read_nodes_41(text, mesh);
      text.expect("$EndNodes");
      nodes = true;
    } else if (section == "$Elements" && !elements) {
      layout == Layout::two ? read_elements_2(text, mesh) : read_elements_41(text, mesh);
      text.expect("$EndElements");
      elements = true;
    } else if (section.starts_with('$') && !section.starts_with("$End")) {
      const std::string end = "$End" + std::string(section.substr(1));
      text.rest_of_line();
      while (text.rest_of_line() != end)
        if (text.at_end()) text.fail("the file ends within the section " + in_quotes(section));
    } else {
      text.fail("found " + in_quotes(section) + " where a section should begin");
    }
  }
  return std::move(mesh).finish(text.file());
}

}  // namespace penalty
