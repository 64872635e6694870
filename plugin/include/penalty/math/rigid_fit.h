// The rotation nearest to a 3 x 3 matrix, and the rigid motion nearest to the velocities of some points.
#pragma once
#include <span>

#include "penalty/math/types.h"

namespace penalty {

/// The rotation R (never a reflection) that maximises tr(Rᵀ A), hence minimises |A - R|. With singular values
/// s1 >= s2 >= |s3|, the last one negative if det A is, it is unique unless s2 + s3 = 0: for an A of rank below two, or
/// a mirror image whose two smallest singular values agree. Then one of the best rotations is returned, always the same
/// for the same A: the identity for A = 0.
///
/// A + cof(A) / |A| has the singular vectors of A and, where R is well defined, only positive singular values, so that
/// R is its polar factor also for flat and for most inverted A: five or so steps of Higham's scaled Newton iteration
/// ("Computing the polar decomposition - with applications", 1986, eq. 3.1-3.2 and its scaling by Frobenius norms).
/// What is too near to singular for that has its singular vectors computed.
Matrix3 best_rotation(const Matrix3& a);

/// v(x) = linear + angular x (x - center). The centre is kept as one of the points and the way from there, so that a
/// small group far from the origin keeps its digits.
struct RigidVelocity {
  Vector3 origin = Vector3::Zero(), from_origin = Vector3::Zero();  // center = origin + from_origin [m]
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();      // [m/s], [1/s]

  Vector3 arm(const Vector3& point) const { return point - origin - from_origin; }
  Vector3 at(const Vector3& point) const { return linear + angular.cross(arm(point)); }
};

/// What stands for the masses of points: one number each, or its inverse.
enum class PointWeights { direct, inverse };

/// The rigid motion with the linear and the angular momentum of `velocities`, for point masses `weights`, one a point:
/// the nearest one in the sense of sum weight |v - v_rigid|². Where the points are on a line, or all in one place, the
/// part of the spin that moves nothing is zero.
RigidVelocity best_rigid_velocity(const Points<dynamic>& points, const Points<dynamic>& velocities,
                                  std::span<const Real> weights, PointWeights kind = PointWeights::direct);

}  // namespace penalty
