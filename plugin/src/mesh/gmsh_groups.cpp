#include "gmsh_groups.h"

#include <algorithm>
#include <limits>

namespace penalty {

void GmshGroups::set_name(std::int64_t dimension, std::int64_t physical, std::string_view name) {
  if (!name.empty()) names_[{dimension, physical}] = name;
}

void GmshGroups::put_entity_in(std::int64_t dimension, std::int64_t entity, std::int64_t physical) {
  physicals_[{dimension, entity}].push_back(physical);
}

void GmshGroups::put_in(std::int64_t dimension, std::int64_t physical, std::span<const std::int64_t> nodes) {
  if (physical == 0) return;
  if (physical < 0) physical = -std::max(physical, -std::numeric_limits<std::int64_t>::max());  // one turned about
  RawGroups& groups = dimension == 3 ? mesh_.regions : mesh_.vertex_sets;
  const auto [group, is_new] = groups_.try_emplace({dimension, physical}, 0);
  if (is_new) {
    const auto name = names_.find({dimension, physical});
    group->second = groups.group(name != names_.end() ? name->second : "physical " + std::to_string(physical));
  }
  if (dimension == 3)
    groups.put(group->second, mesh_.num_solids() - 1);
  else
    for (const std::int64_t node : nodes) groups.put(group->second, node);
}

void GmshGroups::put_in_entity(std::int64_t dimension, std::int64_t entity, std::span<const std::int64_t> nodes) {
  if (dimension == 3) volumes_.put(volumes_.group("volume " + std::to_string(entity)), mesh_.num_solids() - 1);
  const auto found = physicals_.find({dimension, entity});
  if (found == physicals_.end()) return;
  for (const std::int64_t physical : found->second) put_in(dimension, physical, nodes);
}

void GmshGroups::finish() {
  if (mesh_.regions.groups().empty() && volumes_.groups().size() > 1) mesh_.regions = std::move(volumes_);
}

}  // namespace penalty
