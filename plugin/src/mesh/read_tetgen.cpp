// TetGen: points in a .node file, tetrahedra in an .ele file, # comments.
#include "raw_mesh.h"

namespace penalty {
namespace {

void read_nodes(TextCursor& text, RawMesh& mesh) {
  const std::int64_t count = text.count("the number of points", 8);
  const std::int64_t dimension = text.integer("the dimension");
  if (dimension != 3) text.fail("the dimension is " + std::to_string(dimension) + ", not 3");
  const std::int64_t attributes = text.at_line_end() ? 0 : text.integer("the number of attributes");
  const bool has_marker = !text.at_line_end() && text.integer("the number of markers") > 0;
  text.rest_of_line();
  for (std::int64_t i = 0; i < count; ++i) {
    text.within("point", i);
    const std::int64_t tag = text.integer("the number of the point");
    text.within("vertex", tag);
    mesh.origin.vertex_tags.push_back(tag);
    mesh.add_vertex(text);
    for (std::int64_t k = 0; k < attributes && !text.at_line_end(); ++k) text.word("an attribute");
    if (has_marker && !text.at_line_end())
      if (const std::int64_t marker = text.integer("the marker"); marker != 0)
        mesh.vertex_sets.put(mesh.vertex_sets.group("marker " + std::to_string(marker)), tag);
    text.rest_of_line();
  }
}

void read_elements(TextCursor& text, RawMesh& mesh) {
  const std::int64_t count = text.count("the number of tetrahedra", 10);
  const std::int64_t corners = text.integer("the number of nodes of a tetrahedron");
  if (corners != 4 && corners != 10)
    text.fail("the number of nodes of a tetrahedron is " + std::to_string(corners) + ", not 4 or 10");
  const bool has_region = !text.at_line_end() && text.integer("the number of attributes") > 0;
  text.rest_of_line();
  for (std::int64_t i = 0; i < count; ++i) {
    text.within("element", i);
    const std::int64_t tag = text.integer("the number of the tetrahedron");
    text.within("tetrahedron", tag);
    std::array<std::int64_t, 4> nodes;
    for (std::int64_t& node : nodes) node = text.integer("a corner");
    mesh.add(Solid::tetrahedron, nodes, tag, text.line());
    if (corners == 10) mesh.count_reduced();
    for (std::int64_t k = 4; has_region && k < corners && !text.at_line_end(); ++k) text.integer("a node");
    if (has_region && !text.at_line_end())
      mesh.regions.put(mesh.regions.group("region " + to_text(text.real("the attribute"))), mesh.num_solids() - 1);
    text.rest_of_line();
  }
}

void refuse_rest(TextCursor& text) {
  text.within({});
  if (!text.at_end()) text.fail("found " + in_quotes(text.peek()) + " after the last element");
}

}  // namespace

TetMesh read_tetgen(const std::filesystem::path& node_path, const std::filesystem::path& ele_path,
                    const std::filesystem::path& source) {
  RawMesh mesh;
  mesh.origin.vertex_file = node_path.string();
  mesh.origin.tetrahedron_file = ele_path.string();
  const std::string nodes = load_file(node_path);
  TextCursor node_text(mesh.origin.vertex_file, nodes, '#');
  read_nodes(node_text, mesh);
  refuse_rest(node_text);
  const std::string elements = load_file(ele_path);
  TextCursor element_text(mesh.origin.tetrahedron_file, elements, '#');
  read_elements(element_text, mesh);
  refuse_rest(element_text);
  return std::move(mesh).finish(source.string());
}

}  // namespace penalty
