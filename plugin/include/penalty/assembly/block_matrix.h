// A symmetric sparse matrix of 3 x 3 blocks, one block row a particle.
#pragma once
#include <span>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

/// Block-compressed rows. The pattern is built once, from the stencils that will be added; values can then be cleared and
/// added again at every step without allocation.
class BlockMatrix {
 public:
  /// Pairs (row, column) of particle indices that may hold a block, in any order, repetitions allowed. The diagonal is
  /// always there. Throws std::out_of_range for an index outside [0, num_particles).
  BlockMatrix(int num_particles, std::vector<std::pair<int, int>> pattern);

  int num_particles() const { return static_cast<int>(row_begin_.size()) - 1; }
  std::size_t num_blocks() const { return blocks_.size(); }

  void set_zero();

  /// Adds to block (row, column), which must be in the pattern (asserted).
  void add_block(int row, int column, const Matrix3& block);

  Matrix3 block(int row, int column) const;  // zero outside the pattern

  /// y += scale * A x, one column a particle.
  void add_product(const Vectors& x, Real scale, Forces y) const;

  /// The dense 3P x 3P matrix: for tests and small systems.
  Eigen::MatrixXd to_dense() const;

 private:
  std::ptrdiff_t find(int row, int column) const;

  std::vector<int> row_begin_;  // P + 1
  std::vector<int> columns_;    // sorted within a row
  std::vector<Matrix3> blocks_;
};

}  // namespace penalty
