// Contact surfaces of triangle meshes, point i at particle i.
#pragma once
#include <gtest/gtest.h>

#include "math/random.h"
#include "penalty/contact/contact_surface.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {

inline ContactSurface surface_of(const TriangleSurface& mesh) {
  std::vector<WeightedPoint> points;
  points.reserve(mesh.vertices.cols());
  for (int i = 0; i < mesh.vertices.cols(); ++i) points.push_back(WeightedPoint::at_particle(i));
  return {points, mesh.triangles, {}, pack(mesh.vertices)};
}

}  // namespace penalty::testing
