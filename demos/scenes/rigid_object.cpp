#include "scenes/rigid_object.h"

namespace penalty::demo {

Vector3 inertia(const RigidObject& object) {
  if (const auto* ball = std::get_if<Ball>(&object.shape))
    return Vector3::Constant(0.4 * object.mass * ball->radius * ball->radius);
  const Vector3 squares = std::get<Block>(object.shape).half_extents.cwiseAbs2();
  return object.mass / 3 * (Vector3::Constant(squares.sum()) - squares);
}

Real depth(const RigidObject& object, const Pose& pose, const Vector3& point) {
  const Vector3 local = pose.rotation.transpose() * (point - pose.position);
  if (const auto* ball = std::get_if<Ball>(&object.shape)) return ball->radius - local.norm();
  return (std::get<Block>(object.shape).half_extents - local.cwiseAbs()).minCoeff();
}

Real thickness(const RigidObject& object) {
  if (const auto* ball = std::get_if<Ball>(&object.shape)) return 2 * ball->radius;
  return 2 * std::get<Block>(object.shape).half_extents.minCoeff();
}

}  // namespace penalty::demo
