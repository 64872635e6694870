#include "penalty/stepping/rigid_body.h"

#include <Eigen/LU>
#include <Eigen/QR>

namespace penalty {

namespace {

using Six = Eigen::Matrix<Real, 6, 1>;

// Two vectors of each link of an articulated body, of which `first` is the first.
template <class Read>
Eigen::VectorXd of_links(const Articulation& articulation, const RigidBody& first, const Read& read) {
  const std::vector<int>& places = articulation.places;
  Eigen::VectorXd all(6 * static_cast<Eigen::Index>(places.size()));
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto [linear, angular] = read(*(&first + (places[k] - places[0])));
    all.segment<6>(6 * static_cast<Eigen::Index>(k)) << linear, angular;
  }
  return all;
}

// a' I b; angular factors may leave the inverse of the inertia I singular.
Real inertial_product(const Matrix3& inverse_inertia, const Vector3& a, const Vector3& b) {
  if (inverse_inertia.isZero(0)) return 0;
  const Vector3 momentum = inverse_inertia.completeOrthogonalDecomposition().solve(b);
  return a.dot(momentum);
}

}  // namespace

bool RigidBody::is_free() const {
  constexpr Real singular = 1e-12;
  const Real trace = inverse_inertia.trace();
  return !articulation && (inverse_mass.array() > 0).all() &&
         inverse_inertia.determinant() > singular * trace * trace * trace;
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

Real RigidBody::mobility_bound(Real distance) const {
  if (!articulation) return inverse_mass.maxCoeff() + inverse_inertia.norm() * distance * distance;
  const auto [linear, coupled, angular] = own_mobility();
  return linear.norm() + distance * (2 * coupled.norm() + distance * angular.norm());
}

void RigidBody::push_links(const Vector3& given, const Vector3& moment) {
  Six wrench;
  wrench << given, moment;
  RigidBody* const first_of_all = this - articulation->places[static_cast<std::size_t>(link)];
  for (std::size_t k = 0; k < articulation->places.size(); ++k) {
    const Six change = articulation->mobility.block<6, 6>(6 * static_cast<Eigen::Index>(k), 6 * link) * wrench;
    RigidBody& other = first_of_all[articulation->places[k]];
    other.velocity += change.head<3>();
    other.angular_velocity += change.tail<3>();
  }
}

Real kinetic_energy(const RigidBody& body) {
  if (body.articulation) {
    if (body.link != 0) return 0;
    const Eigen::VectorXd velocities = of_links(*body.articulation, body, [](const RigidBody& link) {
      return std::pair(link.velocity, link.angular_velocity);
    });
    return velocities.dot(body.articulation->inertia * velocities) / 2;
  }
  Real twice = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (body.inverse_mass[axis] > 0) twice += body.velocity[axis] * body.velocity[axis] / body.inverse_mass[axis];
  return (twice + inertial_product(body.inverse_inertia, body.angular_velocity, body.angular_velocity)) / 2;
}

Real work_of_accelerations(const RigidBody& body, const RigidBody& start) {
  if (!body.articulation) {
    Real work = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (body.inverse_mass[axis] > 0)
        work += body.acceleration[axis] / body.inverse_mass[axis] * (body.position[axis] - start.position[axis]);
    return work + inertial_product(start.inverse_inertia, body.angular_acceleration, body.turn - start.turn);
  }
  if (body.link != 0) return 0;
  const auto place = [](const RigidBody& link) { return std::pair(link.position, link.turn); };
  const Eigen::VectorXd way = of_links(*body.articulation, body, place) - of_links(*body.articulation, start, place);
  const Eigen::VectorXd accelerations = of_links(*body.articulation, body, [](const RigidBody& link) {
    return std::pair(link.acceleration, link.angular_acceleration);
  });
  return accelerations.dot(body.articulation->inertia * way);
}

}  // namespace penalty
