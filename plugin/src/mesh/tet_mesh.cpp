#include "penalty/mesh/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "mesh_text.h"

namespace penalty {
namespace {

// Words a complaint and throws the exception that suits where the mesh comes from.
class Complaint {
 public:
  Complaint(const TetMesh& mesh, const MeshOrigin* origin) : mesh_(mesh), origin_(origin) {}

  std::string vertex_name(int vertex) const {
    return "vertex " + tag(vertex, origin_ ? &origin_->vertex_tags : nullptr);
  }
  std::string tetrahedron_name(std::size_t t) const {
    return "tetrahedron " + tag(t, origin_ ? &origin_->tetrahedron_tags : nullptr);
  }
  int tetrahedron_line(std::size_t t) const {
    return origin_ && t < origin_->tetrahedron_lines.size() ? origin_->tetrahedron_lines[t] : 0;
  }

  [[noreturn]] void about_vertex(int vertex, const std::string& text) const {
    const auto v = static_cast<std::size_t>(vertex);
    const int line = origin_ && v < origin_->vertex_lines.size() ? origin_->vertex_lines[v] : 0;
    fail(origin_ ? origin_->vertex_file : "", line, vertex_name(vertex) + ": " + text);
  }
  [[noreturn]] void about_tetrahedron(std::size_t t, const std::string& text) const {
    fail(origin_ ? origin_->tetrahedron_file : "", tetrahedron_line(t), tetrahedron_name(t) + ": " + text);
  }
  [[noreturn]] void about_mesh(const std::string& text) const {
    fail(origin_ ? origin_->tetrahedron_file : "", 0, text);
  }

 private:
  static std::string tag(std::size_t index, const std::vector<std::int64_t>* tags) {
    return tags && index < tags->size() ? std::to_string((*tags)[index]) : std::to_string(index);
  }
  [[noreturn]] void fail(const std::string& file, int line, const std::string& text) const {
    std::string message = file.empty() ? (mesh_.source.empty() ? "mesh" : mesh_.source) : file;
    if (line > 0) message += ":" + std::to_string(line);
    message += ": " + text;
    if (origin_) throw MeshError(message);
    throw std::invalid_argument(message);
  }

  const TetMesh& mesh_;
  const MeshOrigin* origin_;
};

void check_vertices(const TetMesh& mesh, const Complaint& complaint) {
  if (mesh.vertices.cols() > std::numeric_limits<int>::max())
    complaint.about_mesh("more vertices than an int can count");
  for (int v = 0; v < mesh.vertices.cols(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      const Real x = mesh.vertices(axis, v);
      if (!std::isfinite(x)) complaint.about_vertex(v, std::string("coordinate ") + "xyz"[axis] + " is " + to_text(x));
      if (std::abs(x) > largest_coordinate)
        complaint.about_vertex(v, std::string("coordinate ") + "xyz"[axis] + " is " + to_text(x) + ", beyond " +
                                      to_text(largest_coordinate));
    }
}

void check_indices(const TetMesh& mesh, const Complaint& complaint) {
  const auto vertices = mesh.vertices.cols();
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const Tetrahedron& t = mesh.tetrahedra[i];
    for (int v : t)
      if (v < 0 || v >= vertices)
        complaint.about_tetrahedron(
            i, "vertex index " + std::to_string(v) + " is outside 0 to " + std::to_string(vertices - 1));
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b)
        if (t[a] == t[b]) complaint.about_tetrahedron(i, complaint.vertex_name(t[a]) + " is used twice");
  }
}

// Where the tetrahedra of the same four vertices are: calls twins(first, other) for each after the first of them.
template <class Call>
void for_each_twin(const TetMesh& mesh, const Call& twins) {
  std::vector<Tetrahedron> sorted = mesh.tetrahedra;
  for (Tetrahedron& t : sorted) std::sort(t.begin(), t.end());
  std::vector<std::size_t> order(sorted.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) { return sorted[l] < sorted[r]; });
  std::size_t first = 0;
  for (std::size_t k = 1; k < order.size(); ++k)
    if (sorted[order[first]] == sorted[order[k]])
      twins(order[first], order[k]);
    else
      first = k;
}

void check_groups(const std::vector<MeshGroup>& groups, std::size_t size, const char* kind, const char* member,
                  const Complaint& complaint) {
  for (const MeshGroup& group : groups)
    for (const int i : group.members)
      if (i < 0 || static_cast<std::size_t>(i) >= size)
        complaint.about_mesh(std::string(kind) + " " + in_quotes(group.name) + ": " + member + " " + std::to_string(i) +
                             " is outside the " + std::to_string(size) + " of the mesh");
}

// Members are numbered anew, -1 being nowhere, put in order, each once; what has none left goes.
void renumber(std::vector<MeshGroup>& groups, const std::vector<int>& new_index) {
  for (auto& [name, members] : groups) {
    for (int& member : members) member = new_index[member];
    std::erase(members, -1);
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
  }
  std::erase_if(groups, [](const MeshGroup& group) { return group.members.empty(); });
}

void check_duplicates(const TetMesh& mesh, const Complaint& complaint) {
  for_each_twin(mesh, [&](std::size_t first, std::size_t other) {
    complaint.about_tetrahedron(other, "same four vertices as " + complaint.tetrahedron_name(first));
  });
}

struct Shape {
  Real longest;   // edge [m]
  Real relative;  // six volumes, signed, over its cube
  Real six_volumes() const { return relative * longest * longest * longest; }
  bool is_flat() const {
    return !(std::abs(relative) >= flat_tetrahedron) || std::abs(six_volumes()) < 6 * std::numeric_limits<Real>::min();
  }
};

Shape shape_of(const TetMesh& mesh, const Tetrahedron& t) {
  Points<4> p;
  for (int k = 0; k < 4; ++k) p.col(k) = mesh.vertices.col(t[k]);
  Real longest = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = a + 1; b < 4; ++b) longest = std::max(longest, (p.col(b) - p.col(a)).stableNorm());
  // Scaled to unit size first: cubes of tiny lengths would underflow.
  const Matrix3 sides = (p.rightCols<3>().colwise() - p.col(0).eval()) / (longest > 0 ? longest : 1);
  return {longest, sides.col(0).dot(sides.col(1).cross(sides.col(2)))};
}

void orient(TetMesh& mesh, const Complaint& complaint) {
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    Tetrahedron& t = mesh.tetrahedra[i];
    const Shape shape = shape_of(mesh, t);
    if (shape.is_flat())
      complaint.about_tetrahedron(
          i, "flat: volume " + to_text(shape.six_volumes() / 6) + " at a longest edge of " + to_text(shape.longest));
    if (shape.relative < 0) {
      std::swap(t[2], t[3]);
      ++mesh.repairs.reoriented;
    }
  }
}

// Vertices of tetrahedra that stand in one place become the first of them.
void merge_vertices(TetMesh& mesh) {
  std::vector<int> kept(static_cast<std::size_t>(mesh.vertices.cols()), -1);
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (const int v : t) kept[v] = v;
  std::vector<int> order;
  for (const int v : kept)
    if (v >= 0) order.push_back(v);
  const auto place = [&](int v) { return std::tuple(mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v)); };
  std::stable_sort(order.begin(), order.end(), [&](int l, int r) { return place(l) < place(r); });
  int merged = 0;
  for (std::size_t k = 1; k < order.size(); ++k)
    if (place(order[k - 1]) == place(order[k])) {
      kept[order[k]] = kept[order[k - 1]];
      ++merged;
    }
  if (merged == 0) return;
  for (Tetrahedron& t : mesh.tetrahedra)
    for (int& v : t) v = kept[v];
  renumber(mesh.vertex_sets, kept);
  mesh.repairs.merged_vertices += merged;
  mesh.repairs.dropped_vertices -= merged;  // as which they will be counted
}

// Of twins all but the first, which takes their place in regions, and what is flat, if that is little.
void drop_tetrahedra(TetMesh& mesh, MeshOrigin& origin) {
  std::vector<int> kept(mesh.tetrahedra.size());  // which stands for it; -1: none
  std::iota(kept.begin(), kept.end(), 0);
  for_each_twin(mesh, [&](std::size_t first, std::size_t other) { kept[other] = static_cast<int>(first); });
  const auto is_kept = [&](std::size_t i) { return kept[i] == static_cast<int>(i); };
  std::vector<std::size_t> flat;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (is_kept(i) && shape_of(mesh, mesh.tetrahedra[i]).is_flat()) flat.push_back(i);
  if (100 * flat.size() <= kept.size())
    for (const std::size_t i : flat) kept[i] = -1;
  const auto keep = [&](auto& list) {
    if (list.size() != kept.size()) return;
    std::size_t size = 0;
    for (std::size_t i = 0; i < list.size(); ++i)
      if (is_kept(i)) list[size++] = list[i];
    list.resize(size);
  };
  keep(origin.tetrahedron_tags);
  keep(origin.tetrahedron_lines);
  keep(mesh.tetrahedra);
  mesh.repairs.dropped_tetrahedra += static_cast<int>(kept.size() - mesh.tetrahedra.size());
  for (int i = 0, index = 0; i < static_cast<int>(kept.size()); ++i)
    kept[i] = kept[i] == i ? index++ : kept[i] < 0 ? -1 : kept[kept[i]];  // the first of twins comes first
  renumber(mesh.regions, kept);
}

void drop_unused_vertices(TetMesh& mesh) {
  std::vector<int> new_index(static_cast<std::size_t>(mesh.vertices.cols()), -1);
  for (const Tetrahedron& t : mesh.tetrahedra)
    for (int v : t) new_index[v] = 0;
  int kept = 0;
  for (std::size_t v = 0; v < new_index.size(); ++v)
    if (new_index[v] == 0) {
      mesh.vertices.col(kept) = mesh.vertices.col(static_cast<Eigen::Index>(v)).eval();
      new_index[v] = kept++;
    }
  renumber(mesh.vertex_sets, new_index);
  const int dropped = static_cast<int>(mesh.vertices.cols()) - kept;
  if (dropped == 0) return;
  mesh.vertices.conservativeResize(Eigen::NoChange, kept);
  mesh.repairs.dropped_vertices += dropped;
  for (Tetrahedron& t : mesh.tetrahedra)
    for (int& v : t) v = new_index[v];
}

void check(const TetMesh& mesh, const Complaint& complaint) {
  check_vertices(mesh, complaint);
  if (mesh.tetrahedra.empty()) complaint.about_mesh("the mesh has no tetrahedra");
  check_indices(mesh, complaint);
  check_groups(mesh.regions, mesh.tetrahedra.size(), "region", "tetrahedron", complaint);
  check_groups(mesh.vertex_sets, static_cast<std::size_t>(mesh.vertices.cols()), "vertex set", "vertex", complaint);
}

}  // namespace

void repair(TetMesh& mesh) {
  const Complaint complaint(mesh, nullptr);
  check(mesh, complaint);
  check_duplicates(mesh, complaint);
  orient(mesh, complaint);
  drop_unused_vertices(mesh);
  std::vector<int> same(mesh.tetrahedra.size());
  std::iota(same.begin(), same.end(), 0);
  renumber(mesh.regions, same);
}

void repair(TetMesh& mesh, const MeshOrigin& origin) {
  MeshOrigin of_kept = origin;
  const Complaint complaint(mesh, &of_kept);
  check(mesh, complaint);
  merge_vertices(mesh);
  drop_tetrahedra(mesh, of_kept);
  orient(mesh, complaint);
  drop_unused_vertices(mesh);
}

std::string to_text(const MeshRepair& repairs) {
  std::string text;
  const auto add = [&text](const char* did, int count, const char* one, const char* many) {
    if (count == 0) return;
    if (!text.empty()) text += ", ";
    text += std::string(did) + " " + std::to_string(count) + " " + (count == 1 ? one : many);
  };
  add("merged", repairs.merged_vertices, "vertex", "vertices");
  add("dropped", repairs.dropped_vertices, "vertex of no element", "vertices of no element");
  add("dropped", repairs.dropped_tetrahedra, "doubled or flat tetrahedron", "doubled or flat tetrahedra");
  add("turned", repairs.reoriented, "left-handed tetrahedron", "left-handed tetrahedra");
  add("cut", repairs.split_solids, "solid into tetrahedra", "solids into tetrahedra");
  add("reduced", repairs.reduced_solids, "element of higher order", "elements of higher order");
  return text;
}

Real volume(const TetMesh& mesh) {
  const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
  return std::accumulate(volumes.begin(), volumes.end(), Real{0});
}

}  // namespace penalty
