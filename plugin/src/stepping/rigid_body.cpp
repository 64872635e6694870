#include "penalty/stepping/rigid_body.h"

#include <Eigen/LU>
#include <Eigen/QR>

namespace penalty {

bool RigidBody::is_free() const {
  constexpr Real singular = 1e-12;
  const Real trace = inverse_inertia.trace();
  return (inverse_mass.array() > 0).all() && inverse_inertia.determinant() > singular * trace * trace * trace;
}

void RigidBody::set_motion(const Vector3& new_velocity, const Vector3& new_angular_velocity) {
  impulse += (new_velocity - velocity).cwiseQuotient(inverse_mass);
  angular_impulse += inverse_inertia.inverse() * (new_angular_velocity - angular_velocity);
  velocity = new_velocity;
  angular_velocity = new_angular_velocity;
}

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
