#include "cut_parts.h"

#include <algorithm>
#include <numeric>

namespace penalty {

std::vector<char> lesser_parts(std::span<const Real> inverse_masses, std::span<const Edge> edges,
                               const std::function<bool(const Edge&)>& is_cut) {
  const std::size_t num_particles = inverse_masses.size();
  std::vector<int> parent(num_particles);
  std::iota(parent.begin(), parent.end(), 0);
  const auto part_of = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<Edge> cuts;
  for (const Edge& edge : edges) {
    if (is_cut(edge)) {
      cuts.push_back(edge);
      continue;
    }
    const int a = part_of(edge[0]), b = part_of(edge[1]);
    parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<char> lesser(num_particles, 0);
  if (cuts.empty()) return lesser;

  std::vector<std::vector<int>> across(num_particles);  // of each part
  for (const auto& [i, j] : cuts) {
    const int a = part_of(i), b = part_of(j);
    if (a == b) continue;
    across[a].push_back(b);
    across[b].push_back(a);
  }
  std::vector<Real> mass(num_particles, 0);
  std::vector<int> parts;
  for (std::size_t i = 0; i < num_particles; ++i) {
    const int part = part_of(static_cast<int>(i));
    if (part == static_cast<int>(i)) parts.push_back(part);
    if (inverse_masses[i] > 0) mass[part] += 1 / inverse_masses[i];
  }
  std::sort(parts.begin(), parts.end(), [&](int a, int b) { return mass[a] != mass[b] ? mass[a] > mass[b] : a < b; });

  std::vector<char> is_colored(num_particles, 0);
  for (const int first : parts) {
    if (is_colored[first]) continue;
    std::vector<int> group{first};
    is_colored[first] = 1;
    Real masses[2] = {0, 0};
    for (std::size_t k = 0; k < group.size(); ++k) {
      const int part = group[k];
      masses[lesser[part] ? 1 : 0] += mass[part];
      for (const int other : across[part]) {
        if (is_colored[other]) continue;
        is_colored[other] = 1;
        lesser[other] = !lesser[part];
        group.push_back(other);
      }
    }
    if (masses[1] > masses[0])
      for (const int part : group) lesser[part] = !lesser[part];
  }
  for (std::size_t i = 0; i < num_particles; ++i) lesser[i] = lesser[part_of(static_cast<int>(i))];
  return lesser;
}

}  // namespace penalty
