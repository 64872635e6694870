// Eigenvalues and singular values for the tests, compiled once: Eigen's solvers take seconds to compile.
#pragma once
#include "penalty/math/types.h"

namespace penalty::testing {

/// In increasing order; `matrix` is symmetric.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

Real smallest_eigenvalue(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

/// In decreasing order.
Vector3 singular_values(const Matrix3& matrix);

}  // namespace penalty::testing
