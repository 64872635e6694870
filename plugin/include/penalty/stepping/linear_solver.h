// Conjugate gradients for the systems of the implicit step.
#pragma once
#include <span>
#include <vector>

#include "penalty/fields/system.h"
#include "penalty/stepping/step_options.h"

namespace penalty {

/// A positive definite system. Particles in `fixed`, sorted, do not move: their rows and columns count as those of the
/// identity.
struct LinearSystem {
  System matrix;
  std::vector<int> fixed;

  /// y = A x but for the rows of fixed particles, which are zero; those of x are to be zero.
  void multiply(const Vectors& x, Forces y) const;

  /// Sets the columns of fixed particles to zero.
  void clear_fixed(Forces v) const;
};

struct LinearReport {
  int iterations = 0;
  Real squared_norm = 0;  // b . P⁻¹ b, P the preconditioner
};

/// Preconditioned conjugate gradients. The preconditioner is additive: the inverses of the 3 x 3 blocks on the diagonal
/// take care of what is stiff and near, and a coarse space of what is smooth: the particles in groups of neighbours,
/// each of which moves as a rigid body (6 unknowns a group, a dense Cholesky factorisation). Deterministic, and
/// without allocation once a system of the same size has been solved.
class LinearSolver {
 public:
  /// Makes the groups from the pattern of the matrix.
  void set_pattern(const BlockMatrix& matrix);

  /// Prepares the preconditioner for the values of the system, with particles at `x` [m].
  void factorize(const LinearSystem& system, const Positions& x);

  /// Solves A x = b from x = 0; the columns of fixed particles become zero. Whatever the number of iterations, b . x >
  /// 0 unless b is zero or not finite.
  LinearReport solve(const LinearSystem& system, const Vectors& b, const LinearOptions& options, Forces x);

  /// r . P⁻¹ r, P the preconditioner.
  Real squared_norm(const LinearSystem& system, const PackedVectors& r);

  int num_groups() const { return static_cast<int>(group_begin_.empty() ? 0 : group_begin_.size() - 1); }

 private:
  void precondition(const LinearSystem& system, const PackedVectors& r, PackedVectors& z);
  void factorize_coarse(const LinearSystem& system, const Positions& x);

  std::vector<int> group_of_;  // of each particle
  std::vector<int> group_begin_, group_members_;
  std::vector<Matrix3> inverse_diagonal_;
  PackedVectors arms_;       // from the centre of the group, in units of its size
  std::vector<Real> moves_;  // 1, of fixed particles 0
  Eigen::MatrixXd coarse_;   // its Cholesky factor in the lower triangle
  Eigen::VectorXd coarse_scale_, coarse_vector_;
  PackedVectors residual_, preconditioned_, search_, product_;
};

}  // namespace penalty
