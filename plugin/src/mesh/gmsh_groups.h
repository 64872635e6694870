// Physical groups and entities of Gmsh files, on their way to the groups of a mesh.
#pragma once
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "raw_mesh.h"

namespace penalty {

/// Where elements belong: solids to regions, the nodes of what has fewer dimensions to vertex sets, both by physical
/// group. Files without physical groups of solids have the volumes of the model instead, if there are several.
class GmshGroups {
 public:
  explicit GmshGroups(RawMesh& mesh) : mesh_(mesh) {}

  /// Before any element: the name of a physical group, and the groups that an entity of the model is in.
  void set_name(std::int64_t dimension, std::int64_t physical, std::string_view name);
  void put_entity_in(std::int64_t dimension, std::int64_t entity, std::int64_t physical);

  /// The solid added last, or the nodes of an element of fewer dimensions, in a physical group, of which 0 is none.
  void put_in(std::int64_t dimension, std::int64_t physical, std::span<const std::int64_t> nodes);

  /// The same in an entity of the model.
  void put_in_entity(std::int64_t dimension, std::int64_t entity, std::span<const std::int64_t> nodes);

  /// After the last element.
  void finish();

 private:
  using Key = std::pair<std::int64_t, std::int64_t>;  // dimension and number
  RawMesh& mesh_;
  RawGroups volumes_;
  std::map<Key, std::string> names_;                    // of physical groups
  std::map<Key, std::size_t> groups_;                   // of the mesh, which stand for these
  std::map<Key, std::vector<std::int64_t>> physicals_;  // that entities of the model are in
};

}  // namespace penalty
