// Where a rigid thing is.
#pragma once
#include "penalty/math/types.h"

namespace penalty::demo {

struct Pose {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 position = Vector3::Zero();  // [m]
};

}  // namespace penalty::demo
