#include "rigid_state.h"

#include <Eigen/Eigenvalues>

namespace penalty {

RigidState::RigidState(const Positions& positions, const Positions& velocities, std::span<const Real> inverse_masses) {
  const Vector3 origin = positions.col(0).head<3>();  // digits are scarce far from the world's
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    const Real m = 1 / inverse_masses[i];
    mass += m;
    center += m * (positions.col(i).head<3>() - origin);
    momentum += m * velocities.col(i).head<3>();
  }
  center = origin + center / mass;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    const Real m = 1 / inverse_masses[i];
    const Vector3 arm = positions.col(i).head<3>() - center;
    spin += m * arm.cross(velocities.col(i).head<3>() - momentum / mass);
    inertia += m * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
  }
}

Matrix3 RigidState::inverse_inertia() const {
  constexpr Real none = 1e-12;  // relative to the largest
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(inertia);
  Matrix3 inverse = Matrix3::Zero();
  for (int k = 0; k < 3; ++k)
    if (eigen.eigenvalues()[k] > none * eigen.eigenvalues()[2])
      inverse += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).transpose() / eigen.eigenvalues()[k];
  return inverse;
}

}  // namespace penalty
