// What of surfaces crosses, and how near they come: from positions alone, by tests of their own.
#pragma once
#include <span>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty::testing {

/// Triangles over particles.
struct Skin {
  const PackedVectors* positions;  // of the particles [m]
  std::vector<Triangle> triangles;
};

/// Edges that go through triangles with which they share no particle, of all skins and within each.
int count_crossings(std::span<const Skin> skins);

/// Least distance of a particle of a triangle from another triangle that it is no corner of [m]. `within`: also of
/// the same skin.
Real least_distance(std::span<const Skin> skins, bool within);

}  // namespace penalty::testing
