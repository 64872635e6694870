// Where a rigid thing is, and how it gets from one place to another.
#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "penalty/math/types.h"

namespace penalty::demo {

struct Pose {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 position = Vector3::Zero();  // [m]

  Vector3 local(const Vector3& point) const { return rotation.transpose() * (point - position); }
};

inline Matrix3 turned(Real degrees, const Vector3& axis) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis.normalized()).toRotationMatrix();
}

/// From 0 at t = 0 to 1 at t = 1, from rest to rest; it stays there before and after.
inline Real smooth_step(Real t) {
  const Real s = std::clamp<Real>(t, 0, 1);
  return s * s * (3 - 2 * s);
}

}  // namespace penalty::demo
