#include "raw_mesh.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "split_solid.h"

namespace penalty {
namespace {

[[noreturn]] void fail_about_twins(const MeshOrigin& origin, int first, int second) {
  const bool in_lines = !origin.vertex_lines.empty();
  std::string message = origin.vertex_file;
  if (in_lines) message.append(":").append(std::to_string(origin.vertex_lines[second]));
  message.append(": vertex ")
      .append(std::to_string(origin.vertex_tags[second]))
      .append(": the number was given before");
  if (in_lines) message.append(", in line ").append(std::to_string(origin.vertex_lines[first]));
  throw MeshError(message);
}

// Finds the vertex of a tag. Files number almost always without gaps: one look then, else a binary search.
class TagIndex {
 public:
  explicit TagIndex(const MeshOrigin& origin) : tags_(origin.vertex_tags) {
    if (std::is_sorted(tags_.begin(), tags_.end(), std::less_equal<>())) return;
    order_.resize(tags_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<int>(i);
    std::stable_sort(order_.begin(), order_.end(), [this](int l, int r) { return tags_[l] < tags_[r]; });
    for (std::size_t i = 1; i < order_.size(); ++i)
      if (tags_[order_[i]] == tags_[order_[i - 1]]) fail_about_twins(origin, order_[i - 1], order_[i]);
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

std::size_t RawGroups::group(const std::string& name) {
  const auto [found, is_new] = by_name_.emplace(name, groups_.size());
  if (is_new) groups_.push_back({name, {}});
  return found->second;
}

void RawMesh::add_vertex(TextCursor& text) {
  for (std::string_view name : {"coordinate x", "coordinate y", "coordinate z"}) {
    coordinates.push_back(text.real(name));
    if (name.back() == 'x') origin.vertex_lines.push_back(text.line());
  }
}

void RawMesh::add(Solid solid, std::span<const std::int64_t> corners, std::int64_t tag, int line) {
  solids_.push_back(solid);
  corners_.insert(corners_.end(), corners.begin(), corners.begin() + static_cast<int>(solid));
  origin.tetrahedron_tags.push_back(tag);
  if (line > 0) origin.tetrahedron_lines.push_back(line);
}

TetMesh RawMesh::finish(std::string source) && {
  if (solids_.empty() && skipped_ > 0)
    throw MeshError(source + ": no solids, only points, lines and faces (" + std::to_string(skipped_) +
                    "): fill them with tetrahedra (TetGen), or give a closed surface as .obj, .ply or .stl");
  TetMesh mesh;
  mesh.source = std::move(source);
  mesh.vertices =
      Eigen::Map<const Eigen::Matrix3Xd>(coordinates.data(), 3, static_cast<Eigen::Index>(coordinates.size() / 3));
  mesh.tetrahedra.reserve(solids_.size());
  const TagIndex index(origin);
  const bool tagged = !origin.vertex_tags.empty();
  const auto vertices = static_cast<std::int64_t>(mesh.vertices.cols());
  const auto find_vertex = [&](std::int64_t vertex) -> std::optional<int> {
    if (tagged) return index.find(vertex);
    if (vertex < 0 || vertex >= vertices) return std::nullopt;
    return static_cast<int>(vertex);
  };
  const auto index_of = [&](std::int64_t corner, std::size_t solid) {
    const std::optional<int> found = find_vertex(corner);
    if (!found)
      fail_about_corner(origin, solid, corner, tagged ? "" : " is outside 0 to " + std::to_string(vertices - 1));
    return *found;
  };
  std::vector<std::int64_t> tags;  // of the tetrahedra, which are those of their solids
  std::vector<int> lines;
  std::vector<int> begins;  // the first tetrahedron of each solid
  auto next = corners_.begin();
  for (std::size_t i = 0; i < solids_.size(); ++i) {
    begins.push_back(static_cast<int>(mesh.tetrahedra.size()));
    std::array<int, 8> corners{};
    const auto size = static_cast<std::size_t>(solids_[i]);
    for (std::size_t k = 0; k < size; ++k) corners[k] = index_of(*next++, i);
    if (solids_[i] == Solid::tetrahedron) {
      mesh.tetrahedra.push_back({corners[0], corners[1], corners[2], corners[3]});
    } else {
      split(solids_[i], std::span(corners).first(size), mesh.vertices, mesh.tetrahedra);
      ++mesh.repairs.split_solids;
    }
    tags.resize(mesh.tetrahedra.size(), origin.tetrahedron_tags[i]);
    if (!origin.tetrahedron_lines.empty()) lines.resize(mesh.tetrahedra.size(), origin.tetrahedron_lines[i]);
  }
  begins.push_back(static_cast<int>(mesh.tetrahedra.size()));
  for (const auto& [name, members] : regions.groups()) {
    mesh.regions.push_back({name, {}});
    for (const std::int64_t solid : members)
      for (int t = begins[solid]; t < begins[solid + 1]; ++t) mesh.regions.back().members.push_back(t);
  }
  for (const auto& [name, members] : vertex_sets.groups()) {
    mesh.vertex_sets.push_back({name, {}});
    for (const std::int64_t vertex : members)
      if (const std::optional<int> found = find_vertex(vertex)) mesh.vertex_sets.back().members.push_back(*found);
  }
  origin.tetrahedron_tags = std::move(tags);
  origin.tetrahedron_lines = std::move(lines);
  mesh.repairs.reduced_solids = reduced_;
  repair(mesh, origin);
  return mesh;
}

}  // namespace penalty
