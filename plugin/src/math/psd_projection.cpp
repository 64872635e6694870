#include "penalty/math/psd_projection.h"

#include <Eigen/Eigenvalues>

namespace penalty::detail {
namespace {

template <class Matrix>
void clamp_eigenvalues(Matrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(matrix);
  if (eigen.eigenvalues()[0] >= 0) return;
  matrix = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

void make_psd(SmallMatrix& matrix) { clamp_eigenvalues(matrix); }
void make_psd(Eigen::MatrixXd& matrix) { clamp_eigenvalues(matrix); }

}  // namespace penalty::detail
