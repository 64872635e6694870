// The nearest positive semidefinite matrix: what makes an indefinite element stiffness usable in Newton's method.
#pragma once
#include <Eigen/Eigenvalues>

#include "penalty/math/types.h"

namespace penalty {

/// The symmetric positive semidefinite matrix nearest to the symmetric `matrix` in the Frobenius norm: its negative
/// eigenvalues are set to zero.
template <int Size>
Eigen::Matrix<Real, Size, Size> psd_projection(const Eigen::Matrix<Real, Size, Size>& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<Real, Size, Size>> eigen(matrix);
  if (eigen.eigenvalues()[0] >= 0) return matrix;
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace penalty
