#include "raw_mesh.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace penalty {
namespace {

// Finds the vertex of a tag. Files number almost always without gaps: one look then, else a binary search.
class TagIndex {
 public:
  explicit TagIndex(const MeshOrigin& origin) : tags_(origin.vertex_tags) {
    if (std::is_sorted(tags_.begin(), tags_.end(), std::less_equal<>())) return;
    order_.resize(tags_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<int>(i);
    std::stable_sort(order_.begin(), order_.end(), [this](int l, int r) { return tags_[l] < tags_[r]; });
    for (std::size_t i = 1; i < order_.size(); ++i)
      if (tags_[order_[i]] == tags_[order_[i - 1]])
        throw MeshError(origin.vertex_file + ":" + std::to_string(origin.vertex_lines[order_[i]]) + ": vertex " +
                        std::to_string(tags_[order_[i]]) + ": the number was given before, in line " +
                        std::to_string(origin.vertex_lines[order_[i - 1]]));
  }

  std::optional<int> find(std::int64_t tag) const {
    if (tags_.empty()) return std::nullopt;
    if (order_.empty()) {
      const std::uint64_t guess = static_cast<std::uint64_t>(tag) - static_cast<std::uint64_t>(tags_.front());
      if (guess < tags_.size() && tags_[guess] == tag) return static_cast<int>(guess);
      const auto found = std::lower_bound(tags_.begin(), tags_.end(), tag);
      if (found == tags_.end() || *found != tag) return std::nullopt;
      return static_cast<int>(found - tags_.begin());
    }
    const auto found =
        std::lower_bound(order_.begin(), order_.end(), tag, [this](int i, std::int64_t t) { return tags_[i] < t; });
    if (found == order_.end() || tags_[*found] != tag) return std::nullopt;
    return *found;
  }

 private:
  const std::vector<std::int64_t>& tags_;
  std::vector<int> order_;  // by tag; empty if the tags ascend
};

[[noreturn]] void fail_about_corner(const MeshOrigin& origin, std::size_t tetrahedron, std::int64_t corner,
                                    const std::string& why) {
  std::string message = origin.tetrahedron_file;
  if (!origin.tetrahedron_lines.empty())
    message.append(":").append(std::to_string(origin.tetrahedron_lines[tetrahedron]));
  message.append(": tetrahedron ").append(std::to_string(origin.tetrahedron_tags[tetrahedron]));
  message.append(why.empty() ? ": there is no vertex " : ": vertex index ").append(std::to_string(corner)).append(why);
  throw MeshError(message);
}

}  // namespace

void RawMesh::add_vertex(TextCursor& text) {
  for (std::string_view name : {"coordinate x", "coordinate y", "coordinate z"}) {
    coordinates.push_back(text.real(name));
    if (name.back() == 'x') origin.vertex_lines.push_back(text.line());
  }
}

void RawMesh::add_tetrahedron(TextCursor& text, std::int64_t tag) {
  std::array<std::int64_t, 4> corners;
  for (std::int64_t& corner : corners) corner = text.integer("a corner");
  tetrahedra.push_back(corners);
  origin.tetrahedron_tags.push_back(tag);
  origin.tetrahedron_lines.push_back(text.line());
}

TetMesh RawMesh::finish(std::string source) && {
  TetMesh mesh;
  mesh.source = std::move(source);
  mesh.vertices =
      Eigen::Map<const Eigen::Matrix3Xd>(coordinates.data(), 3, static_cast<Eigen::Index>(coordinates.size() / 3));
  mesh.tetrahedra.reserve(tetrahedra.size());
  const TagIndex index(origin);
  const bool tagged = !origin.vertex_tags.empty();
  const auto vertices = static_cast<std::int64_t>(mesh.vertices.cols());
  for (std::size_t i = 0; i < tetrahedra.size(); ++i) {
    Tetrahedron t;
    for (int k = 0; k < 4; ++k) {
      const std::int64_t corner = tetrahedra[i][k];
      std::optional<int> found;
      if (tagged)
        found = index.find(corner);
      else if (corner >= 0 && corner < vertices)
        found = static_cast<int>(corner);
      if (!found)
        fail_about_corner(origin, i, corner, tagged ? "" : " is outside 0 to " + std::to_string(vertices - 1));
      t[k] = *found;
    }
    mesh.tetrahedra.push_back(t);
  }
  repair(mesh, origin);
  return mesh;
}

}  // namespace penalty
