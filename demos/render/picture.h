// What is to be seen, as plain data: bodies and ground (Frame), and the writing over them (Overlay).
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "penalty/fields/topology.h"
#include "render/camera.h"
#include "render/color.h"
#include "render/curve.h"

namespace penalty::render {

using Transform = Eigen::Matrix<double, 3, 4>;  // columns 0 to 2: rotation, column 3: position [m]

inline Transform at(const Eigen::Vector3d& position) {
  Transform transform = Transform::Identity();
  transform.col(3) = position;
  return transform;
}

/// The surface of a soft body. Triangles with a non-finite vertex are not drawn.
struct SoftSurface {
  Eigen::Matrix3Xd vertices{};        // 3 x V [m]
  std::vector<Triangle> triangles{};  // counter-clockwise seen from outside
  Eigen::VectorXd values{};           // V, coloured by Frame::colors; empty: `color` all over
  Color color{0.36f, 0.58f, 0.78f};
  bool wire = true;  // draw the triangles' edges; they fade where they come closer than a few pixels
};

struct Sphere {
  double radius;
};
struct Box {
  Eigen::Vector3d half_extents;
};
struct Capsule {  // along its y axis
  double radius;
  double half_height;  // of the straight part
};
struct Cylinder {  // along its y axis
  double radius;
  double half_height;
};
/// The head of an arrow: along its y axis, its tip at +half_height(). All cones are of one proportion, so that one mesh
/// has the normals of all.
struct Cone {
  double radius;
  static constexpr double slope = 2.6;  // height over radius
  double half_height() const { return slope / 2 * radius; }
};
using Shape = std::variant<Sphere, Box, Capsule, Cylinder, Cone>;

struct RigidBody {
  Shape shape;
  Transform transform = at({0, 0, 0});
  Color color = palette(0);
  bool two_tone = true;  // octants alternate in brightness, so that spin is seen
};

/// A small ball that points something out, for instance a pinned node.
struct Marker {
  Eigen::Vector3d position;
  Color color{0.93f, 0.93f, 0.90f};
  double radius = 0;  // [m]; 0: one that suits the picture
};

struct Frame {
  Camera camera{};
  ColorScale colors{};  // fixed over a clip, else colours mean something else in every frame
  std::vector<SoftSurface> surfaces{};
  std::vector<RigidBody> bodies{};
  std::vector<Marker> markers{};
  std::optional<double> ground{};  // height y [m]; none: nothing below
};

/// Bounds of all that `frame` shows, but for the ground.
Bounds bounds_of(const Frame& frame);

/// Labelled scale of Frame::colors at the right edge.
struct ColorBar {
  std::string label{};  // may hold line breaks: "strain energy\ndensity [kJ/m³]"
  double unit = 1;      // ticks show value / unit, 1e3 for "kJ"
};

/// Curves over time in the lower left corner.
struct Inset {
  std::string title{};  // "energy [J]"
  std::vector<Series> series{};
  double x_low = 0, x_high = 1;  // the whole clip, so that the curve grows into its frame
  double y_low = 0, y_high = 0;  // y_low == y_high: from the data
  std::string x_unit = "s";
};

/// All texts are UTF-8; Latin, Greek and the common signs are drawn.
struct Overlay {
  std::string title{};
  std::vector<std::string> subtitle{};  // parts, joined by middle dots: {"t = 0.330 s", "24576 tetrahedra"}
  std::optional<ColorBar> color_bar{};
  std::optional<Inset> inset{};
};

}  // namespace penalty::render
