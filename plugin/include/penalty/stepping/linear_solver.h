// Conjugate gradients for the systems of the implicit step.
#pragma once
#include <span>
#include <vector>

#include "penalty/contact/weighted_point.h"
#include "penalty/fields/system.h"
#include "penalty/stepping/step_options.h"

namespace penalty {

/// What a contact adds to a system: Jᵀ G J, where J x is what x says of the point.
struct ContactStiffness {
  WeightedPoint point;
  Matrix3 stiffness;  // G, positive semidefinite [N/m]
};

/// A positive definite system: matrix + contacts. Particles in `fixed`, sorted, do not move: their rows and columns count
/// as those of the identity.
struct LinearSystem {
  System matrix;
  std::vector<ContactStiffness> contacts = {};
  std::vector<int> fixed = {};

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

  /// The same, where nothing but the contacts has changed since.
  void factorize_contacts(const LinearSystem& system);

  /// Solves A x = b from x = 0; the columns of fixed particles become zero. Whatever the number of iterations, b . x >
  /// 0 unless b is zero or not finite.
  LinearReport solve(const LinearSystem& system, const Vectors& b, const LinearOptions& options, Forces x);

  /// r . P⁻¹ r, P the preconditioner.
  Real squared_norm(const LinearSystem& system, const PackedVectors& r);

  int num_groups() const { return static_cast<int>(group_begin_.empty() ? 0 : group_begin_.size() - 1); }

 private:
  void precondition(const LinearSystem& system, const PackedVectors& r, PackedVectors& z);
  void sum_blocks(const LinearSystem& system);
  void sum_coarse_blocks(const LinearSystem& system, const Positions& x);
  void invert_diagonal(const LinearSystem& system);
  void factorize_coarse(const LinearSystem& system);
  void add_coarse_block(int i, int j, const Matrix3& block, Eigen::MatrixXd& coarse) const;

  std::vector<int> group_of_;  // of each particle
  std::vector<int> group_begin_, group_members_;
  std::vector<Matrix3> diagonal_, inverse_diagonal_;  // the first without contacts
  PackedVectors arms_;                                // from the centre of the group, in units of its size
  std::vector<Real> moves_;                           // 1, of fixed particles 0
  Eigen::MatrixXd coarse_blocks_;                     // the coarse matrix without contacts, lower triangle
  Eigen::MatrixXd coarse_;                            // its Cholesky factor, contacts included, in the lower triangle
  Eigen::VectorXd coarse_scale_, coarse_vector_;
  PackedVectors residual_, preconditioned_, search_, product_;
};

}  // namespace penalty
