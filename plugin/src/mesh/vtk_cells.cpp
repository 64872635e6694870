#include "vtk_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace penalty {
namespace {

// What VTK says of a type of cells. All list their corners first, and go round as ours do, but voxels.
struct CellType {
  int nodes;                   // 0: any number, of any order; -1: unknown
  std::optional<Solid> solid;  // none: points, lines, faces
  const char* name;
};

CellType cell_type(std::int64_t type) {
  const bool is_lower = (type >= 0 && type <= 9) || (type >= 21 && type <= 23) || type == 28 || type == 30 ||
                        (type >= 34 && type <= 36) || (type >= 68 && type <= 70) || (type >= 75 && type <= 77);
  if (is_lower) return {0, std::nullopt, ""};
  switch (type) {
    case 10:
      return {4, Solid::tetrahedron, "tetrahedron"};
    case 11:
      return {8, Solid::hexahedron, "voxel"};
    case 12:
      return {8, Solid::hexahedron, "hexahedron"};
    case 13:
      return {6, Solid::prism, "wedge"};
    case 14:
      return {5, Solid::pyramid, "pyramid"};
    case 24:
      return {10, Solid::tetrahedron, "tetrahedron"};
    case 25:
      return {20, Solid::hexahedron, "hexahedron"};
    case 26:
      return {15, Solid::prism, "wedge"};
    case 27:
      return {13, Solid::pyramid, "pyramid"};
    case 29:
      return {27, Solid::hexahedron, "hexahedron"};
    case 31:
      return {12, Solid::prism, "wedge"};
    case 32:
      return {18, Solid::prism, "wedge"};
    case 33:
      return {24, Solid::hexahedron, "hexahedron"};
    case 71:
    case 78:
      return {0, Solid::tetrahedron, "tetrahedron"};
    case 72:
    case 79:
      return {0, Solid::hexahedron, "hexahedron"};
    case 73:
    case 80:
      return {0, Solid::prism, "wedge"};
    case 74:
    case 81:
      return {0, Solid::pyramid, "pyramid"};
    default:
      return {-1, std::nullopt, ""};
  }
}

// More different values than this number things rather than group them.
constexpr std::size_t most_groups = 256;

// Whole numbers, and few.
bool are_groups(const VtkArray& array) {
  std::set<double> different;
  for (const double value : array.values) {
    if (!(std::abs(value) < 1e15) || value != std::floor(value)) return false;
    different.insert(value);
    if (different.size() > most_groups) return false;
  }
  return array.is_integer || different.size() > 1;
}

}  // namespace

std::string VtkCells::add(std::int64_t type, RawMesh& mesh) {
  const std::size_t cell = solids_.size();
  const CellType known = cell_type(type);
  if (known.nodes < 0)
    return "type " + std::to_string(type) + " is not read: save the mesh with cells of first or second order";
  solids_.push_back(-1);
  if (!known.solid) {
    mesh.count_skipped();
    return "";
  }
  const auto begin = static_cast<std::size_t>(begins[cell]);
  const std::size_t nodes = static_cast<std::size_t>(begins[cell + 1]) - begin;
  const auto size = static_cast<std::size_t>(*known.solid);
  const bool fits = known.nodes > 0 ? nodes == static_cast<std::size_t>(known.nodes) : nodes >= size;
  if (!fits)
    return std::string("a ") + known.name + " with " + std::to_string(nodes) + " corners, not " +
           std::to_string(known.nodes > 0 ? known.nodes : static_cast<int>(size));
  std::array<std::int64_t, 8> list;
  std::copy_n(corners.begin() + static_cast<std::ptrdiff_t>(begin), size, list.begin());
  if (type == 11) {  // a voxel goes by rows
    std::swap(list[2], list[3]);
    std::swap(list[6], list[7]);
  }
  solids_.back() = mesh.num_solids();
  mesh.add(*known.solid, list, static_cast<std::int64_t>(cell), lines.empty() ? 0 : lines[begin]);
  if (nodes > size) mesh.count_reduced();
  return "";
}

void VtkCells::put_in_groups(const VtkArray& array, bool is_of_cells, RawMesh& mesh) const {
  if (!are_groups(array)) return;
  std::map<double, std::size_t> regions, sets;
  const auto put = [&](std::map<double, std::size_t>& numbers, RawGroups& groups, double value, std::int64_t member) {
    const auto [group, is_new] = numbers.try_emplace(value, 0);
    if (is_new) group->second = groups.group(array.name + " " + std::to_string(static_cast<std::int64_t>(value)));
    groups.put(group->second, member);
  };
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    const double value = array.values[i];
    if (is_of_cells && solids_[i] >= 0) {
      put(regions, mesh.regions, value, solids_[i]);
    } else if (is_of_cells && value != 0) {
      for (std::int64_t k = begins[i]; k < begins[i + 1]; ++k) put(sets, mesh.vertex_sets, value, corners[k]);
    } else if (value != 0) {
      put(sets, mesh.vertex_sets, value, static_cast<std::int64_t>(i));
    }
  }
}

}  // namespace penalty
