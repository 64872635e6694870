#include "math/eigenvalues.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace penalty::testing {

Eigen::VectorXd symmetric_eigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

Real smallest_eigenvalue(const Eigen::Ref<const Eigen::MatrixXd>& matrix) { return symmetric_eigenvalues(matrix)[0]; }

Vector3 singular_values(const Matrix3& matrix) { return Eigen::JacobiSVD<Matrix3>(matrix).singularValues(); }

}  // namespace penalty::testing
