// What of a soft body touches other soft bodies.
#pragma once
#include <vector>

#include "penalty/contact/weighted_point.h"
#include "penalty/fields/topology.h"

namespace penalty {

struct EmbeddedSurface;

/// Triangles over points of a body, counter-clockwise seen from outside.
struct BodySurface {
  std::vector<WeightedPoint> points = {};
  std::vector<Triangle> triangles = {};

  /// An embedded surface, vertex by vertex, over the nodes of its lattice.
  static BodySurface of(const EmbeddedSurface& embedded);
};

}  // namespace penalty
