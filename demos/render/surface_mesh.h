// Triangles of a soft body's surface as the shaders want them.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "render/picture.h"

namespace penalty::render {

/// The shaders work where the scene is a unit sphere about the origin: one set of biases, widths and distances then
/// suits a screw as well as a bridge, and large coordinates cost no precision.
struct UnitSpace {
  Eigen::Vector3d center{0, 0, 0};  // [m]
  double radius = 1;                // [m]

  Eigen::Vector3f operator()(const Eigen::Vector3d& point) const { return ((point - center) / radius).cast<float>(); }
};

struct SurfaceVertex {
  float position[3];
  float normal[3];
  float value;  // place on the colour map
};

/// Appends three vertices a triangle (unindexed: the vertex number then tells the corner, which the wires need).
/// Normals are means of the triangles around a vertex, weighted by area; triangles that meet at more than some 50
/// degrees keep their edge. Throws std::invalid_argument naming a bad index or a wrong number of values.
void append_surface(const SoftSurface& surface, const ColorScale& colors, const UnitSpace& space,
                    std::vector<SurfaceVertex>& vertices);

}  // namespace penalty::render
