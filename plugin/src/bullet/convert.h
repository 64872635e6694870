// Between Bullet's vectors and ours.
#pragma once
#include <LinearMath/btMatrix3x3.h>
#include <LinearMath/btVector3.h>

#include "penalty/math/types.h"

namespace penalty {

inline Vector3 to_vector(const btVector3& v) { return {Real(v.x()), Real(v.y()), Real(v.z())}; }

template <class Vector>
btVector3 to_bullet(const Vector& v) {
  return {static_cast<btScalar>(v[0]), static_cast<btScalar>(v[1]), static_cast<btScalar>(v[2])};
}

inline Matrix3 to_matrix(const btMatrix3x3& m) {
  Matrix3 result;
  for (int row = 0; row < 3; ++row) result.row(row) = to_vector(m[row]).transpose();
  return result;
}

}  // namespace penalty
