#include "penalty/solvers/rigid_body.h"

namespace penalty {

void RigidBody::drift(Real duration) {
  position += duration * velocity;
  const Vector3 angle = duration * angular_velocity;
  const Real magnitude = angle.norm();
  if (!(magnitude > 1e-14)) return;
  turn += angle;
  const Matrix3 step = Eigen::AngleAxis<Real>(magnitude, angle / magnitude).toRotationMatrix();
  rotation = step * rotation;
  inverse_inertia = step * inverse_inertia * step.transpose();
}

}  // namespace penalty
