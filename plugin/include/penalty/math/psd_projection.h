// The nearest positive semidefinite matrix: what makes an indefinite element stiffness usable in Newton's method.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

namespace detail {

/// The size is known at run time only, which compiles once for all elements of up to four points, and needs no heap.
using SmallMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 12, 12>;

void make_psd(SmallMatrix& matrix);
void make_psd(Eigen::MatrixXd& matrix);

}  // namespace detail

/// The symmetric positive semidefinite matrix nearest to the symmetric `matrix` in the Frobenius norm: its negative
/// eigenvalues are set to zero. Allocates beyond 12 x 12 only.
template <int Size>
Eigen::Matrix<Real, Size, Size> psd_projection(const Eigen::Matrix<Real, Size, Size>& matrix) {
  std::conditional_t<Size != Eigen::Dynamic && Size <= 12, detail::SmallMatrix, Eigen::MatrixXd> projected = matrix;
  detail::make_psd(projected);
  return projected;
}

}  // namespace penalty
