#include "render/arrow.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace penalty::render {
namespace {

/// y along `direction`.
Transform placed(const Eigen::Vector3d& center, const Eigen::Vector3d& direction) {
  Transform transform = at(center);
  transform.col(0) = direction.unitOrthogonal();
  transform.col(1) = direction;
  transform.col(2) = transform.col(0).cross(direction);
  return transform;
}

}  // namespace

void append_bar(std::vector<RigidBody>& bodies, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                const Color& color) {
  const double length = (to - from).norm();
  if (!(length > 0)) return;
  bodies.push_back({.shape = Cylinder{radius, length / 2},
                    .transform = placed((from + to) / 2, (to - from) / length),
                    .color = color,
                    .two_tone = false});
}

void append_arrow(std::vector<RigidBody>& bodies, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                  const Color& color) {
  const double length = (to - from).norm();
  if (!(length > 0)) return;
  const Eigen::Vector3d direction = (to - from) / length;
  const Cone head{std::min(2.4 * radius, length / Cone::slope)};
  const Eigen::Vector3d middle = to - head.half_height() * direction, neck = middle - head.half_height() * direction;
  bodies.push_back({.shape = head, .transform = placed(middle, direction), .color = color, .two_tone = false});
  if ((neck - from).dot(direction) > 1e-6 * length) append_bar(bodies, from, neck, radius, color);
}

}  // namespace penalty::render
