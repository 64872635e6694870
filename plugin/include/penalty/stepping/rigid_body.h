// A rigid body as the sub-cycle sees it.
#pragma once
#include <utility>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

/// How the links of an articulated body that take part in a step answer to impulses: as its joints and its other links
/// let them.
struct Articulation {
  std::vector<int> places;  // of its links, in the array that holds all rigid bodies
  // Changes of velocities and angular velocities by unit impulses and moments, six rows and columns a link, in the axes of
  // the world and the same throughout a step; and the pseudo-inverse, since joints leave that singular.
  Eigen::MatrixXd mobility, inertia;
};

/// Position, velocity and what contacts and couplings do to them in one step. Zero inverse mass and inertia: a static or
/// kinematic obstacle, which moves with its velocities and takes no impulse.
struct RigidBody {
  Vector3 position = Vector3::Zero();          // centre of mass [m]
  Matrix3 rotation = Matrix3::Identity();      // body to world
  Vector3 velocity = Vector3::Zero();          // [m/s]
  Vector3 angular_velocity = Vector3::Zero();  // world [rad/s]
  Vector3 inverse_mass = Vector3::Zero();      // along the world axes [1/kg]
  Matrix3 inverse_inertia = Matrix3::Zero();   // world, at `rotation` [1/(kg m²)]
  Vector3 acceleration = Vector3::Zero();      // that acts besides the contacts: gravity, other contacts [m/s²]

  Vector3 angular_acceleration = Vector3::Zero();  // likewise [rad/s²]

  // A link of an articulated body lies in one array with the others, and has no inverse mass and inertia of its own.
  const Articulation* articulation = nullptr;
  int link = 0;  // the number of this one among them

  Vector3 impulse = Vector3::Zero();          // that it was given, summed [N s]
  Vector3 angular_impulse = Vector3::Zero();  // about the centre of mass [N m s]
  Vector3 turn = Vector3::Zero();             // integral of the angular velocity [rad]

  bool is_dynamic() const { return articulation || !inverse_mass.isZero(0) || !inverse_inertia.isZero(0); }

  bool is_at_rest() const { return !is_dynamic() && velocity.isZero(0) && angular_velocity.isZero(0); }

  /// It takes impulses and moments in every direction.
  bool is_free() const;

  /// Of the point at `arm` from the centre of mass, along the world axes [m]: velocity [m/s].
  Vector3 velocity_at(const Vector3& arm) const { return velocity + angular_velocity.cross(arm); }

  /// Changes of the velocity at `arm`, by columns, by unit impulses there [1/kg].
  Matrix3 mobility_at(const Vector3& arm) const {
    Matrix3 cross;  // cross * x = arm x x
    cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    if (articulation) {
      const auto [linear, coupled, angular] = own_mobility();
      const Matrix3 by_moment = coupled * cross;
      return linear + by_moment + by_moment.transpose() + cross.transpose() * angular * cross;
    }
    Matrix3 mobility = cross.transpose() * (inverse_inertia * cross);
    mobility.diagonal() += inverse_mass;
    return mobility;
  }

  /// Gives it an impulse [N s] at `arm`, booked in `impulse` and `angular_impulse`. Returns its work [J].
  Real push(const Vector3& given, const Vector3& arm) {
    const Vector3 moment = arm.cross(given);
    const auto [dv, dw] = response(given, moment);
    const Real work = given.dot(velocity + dv / 2) + moment.dot(angular_velocity + dw / 2);
    give(given, moment);
    return work;
  }

  /// Gives it an impulse [N s] at the centre of mass and a moment [N m s] about it, booked likewise.
  void give(const Vector3& given, const Vector3& moment) {
    if (articulation) {
      push_links(given, moment);
    } else {
      velocity += inverse_mass.cwiseProduct(given);
      angular_velocity += inverse_inertia * moment;
    }
    impulse += given;
    angular_impulse += moment;
  }

  /// Changes of its velocities [m/s], [rad/s] by an impulse [N s] at the centre of mass and a moment [N m s] about it.
  std::pair<Vector3, Vector3> response(const Vector3& given, const Vector3& moment) const {
    if (articulation) {
      const auto [linear, coupled, angular] = own_mobility();
      return {linear * given + coupled * moment, coupled.transpose() * given + angular * moment};
    }
    return {inverse_mass.cwiseProduct(given), inverse_inertia * moment};
  }

  /// No less than the mobility of any point at this distance [m] from the centre of mass [1/kg].
  Real mobility_bound(Real distance) const;

  /// Gives a free body these velocities [m/s], [rad/s], booked like a push.
  void set_motion(const Vector3& new_velocity, const Vector3& new_angular_velocity);

  /// What acts besides the contacts, for `time` [s].
  void kick(Real time) {
    velocity += time * acceleration;
    angular_velocity += time * angular_acceleration;
  }

  /// Moves the body for `duration` [s] at its velocities.
  void drift(Real duration);

 private:
  struct OwnMobility {
    Matrix3 linear, coupled, angular;  // velocity to impulses, to moments; angular velocity to moments
  };
  OwnMobility own_mobility() const {
    const Eigen::Index at = 6 * link;
    const Eigen::MatrixXd& all = articulation->mobility;
    return {all.block<3, 3>(at, at), all.block<3, 3>(at, at + 3), all.block<3, 3>(at + 3, at + 3)};
  }
  void push_links(const Vector3& given, const Vector3& moment);  // all that this one moves, itself included
};

/// [J]; that of all links of an articulated body, which is the least it can have when they move like that, is the first one's.
Real kinetic_energy(const RigidBody& body);

/// What `acceleration` and `angular_acceleration` have done to the body since it was at `start` [J]; for links as above.
Real work_of_accelerations(const RigidBody& body, const RigidBody& start);

}  // namespace penalty
