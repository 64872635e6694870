#include "penalty/stepping/rigid_body.h"

#include <Eigen/QR>

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

Real kinetic_energy(const RigidBody& body) {
  Real twice = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (body.inverse_mass[axis] > 0) twice += body.velocity[axis] * body.velocity[axis] / body.inverse_mass[axis];
  if (!body.inverse_inertia.isZero(0))  // angular factors may leave it singular
    twice +=
        body.angular_velocity.dot(body.inverse_inertia.completeOrthogonalDecomposition().solve(body.angular_velocity));
  return twice / 2;
}

}  // namespace penalty
