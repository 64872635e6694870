#include "render/picture.h"

#include <cmath>
#include <numbers>

namespace penalty::render {
namespace {

/// Adds the outermost points of a body.
struct Outline {
  const Transform& transform;
  Bounds& bounds;

  Eigen::Vector3d placed(double x, double y, double z) const {
    return transform.leftCols<3>() * Eigen::Vector3d(x, y, z) + transform.col(3);
  }
  void operator()(const Sphere& s) const { bounds.add(transform.col(3), s.radius); }
  void operator()(const Box& b) const {
    const Eigen::Vector3d& h = b.half_extents;
    for (int i = 0; i < 8; ++i)
      bounds.add(placed(i & 1 ? h.x() : -h.x(), i & 2 ? h.y() : -h.y(), i & 4 ? h.z() : -h.z()));
  }
  void operator()(const Capsule& c) const {
    for (const double end : {-c.half_height, c.half_height}) bounds.add(placed(0, end, 0), c.radius);
  }
  void operator()(const Cylinder& c) const {
    for (const double end : {-c.half_height, c.half_height}) add_circle(c.radius, end);
  }
  void operator()(const Cone& c) const {
    add_circle(c.radius, -c.half_height());
    bounds.add(placed(0, c.half_height(), 0));
  }
  void add_circle(double radius, double y) const {
    constexpr int around = 16;
    for (int i = 0; i < around; ++i) {
      const double turn = 2 * std::numbers::pi * i / around;
      bounds.add(placed(radius * std::cos(turn), y, radius * std::sin(turn)));
    }
  }
};

}  // namespace

Bounds bounds_of(const Frame& frame) {
  Bounds bounds;
  for (const SoftSurface& surface : frame.surfaces)
    for (Eigen::Index i = 0; i < surface.vertices.cols(); ++i) bounds.add(surface.vertices.col(i));
  for (const RigidBody& body : frame.bodies) std::visit(Outline{body.transform, bounds}, body.shape);
  for (const Marker& marker : frame.markers) bounds.add(marker.position, marker.radius);
  return bounds;
}

}  // namespace penalty::render
