// The matrix of one soft body in the systems of the implicit step.
#pragma once
#include <vector>

#include "penalty/fields/system.h"

namespace penalty {

/// Its values, and its part of the preconditioner of LinearSolver: the blocks on the diagonal, and the coarse matrix
/// Zᵀ A Z of groups of neighbouring particles, column 6g + k of Z being the k-th rigid motion of group g: particle i, at r_i
/// from its centre, moves by t + w x r_i.
class BodyMatrix {
 public:
  System values;
  std::vector<int> fixed = {};  // particles that do not move, ascending

  int num_particles() const { return values.num_particles(); }

  static constexpr int most_groups = 40;  // of a large body by itself: the factorisation costs the cube of all

  /// Makes at most so many groups from the pattern of the values: once it is there.
  void make_groups(int most = most_groups);
  int num_groups() const { return static_cast<int>(group_begin_.empty() ? 0 : group_begin_.size() - 1); }

  /// Makes the part of the preconditioner of the values, with particles at `x` [m].
  void factorize(const Positions& x);

  const std::vector<int>& group_of() const { return group_of_; }      // of each particle
  const std::vector<Real>& moves() const { return moves_; }           // 1, of fixed particles 0
  const PackedVectors& arms() const { return arms_; }                 // r_i, in units of the size of the group
  const std::vector<Matrix3>& diagonal() const { return diagonal_; }  // blocks, rank-one terms included
  const Eigen::MatrixXd& coarse() const { return coarse_; }           // lower triangle

 private:
  void sum_diagonal();
  void sum_coarse(const Positions& x);
  void add_coarse_block(int i, int j, const Matrix3& block);

  std::vector<int> group_of_, group_begin_, group_members_;
  std::vector<Real> moves_;
  PackedVectors arms_;
  std::vector<Matrix3> diagonal_;
  Eigen::MatrixXd coarse_;
  Eigen::VectorXd motion_;  // of a rank-one term
};

}  // namespace penalty
