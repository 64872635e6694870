// The types of elements in Gmsh files.
#pragma once
#include <cstdint>
#include <optional>

#include "raw_mesh.h"

namespace penalty {

/// What the Gmsh manual, section "MSH file format", says of an element type. All list their corners first.
struct GmshElement {
  int nodes = 0;               // 0: nothing that is read
  std::optional<Solid> solid;  // none: a point, a line or a face
  int dimension = 3;
};

GmshElement gmsh_element(std::int64_t type);

}  // namespace penalty
