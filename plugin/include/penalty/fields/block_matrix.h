// A symmetric sparse matrix of 3 x 3 blocks, one block row a particle.
#pragma once
#include <span>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

/// Block-compressed rows. The pattern is built once, from the stencils that will be added; values can then be cleared
/// and added again at every step. Elements come in the same order each time, so the matrix remembers where each block
/// went and searches only where that order has changed; what it remembers is allocated in the first round.
class BlockMatrix {
 public:
  /// Pairs (row, column) of particle indices that may hold a block, in any order, repetitions allowed. The diagonal is
  /// always there. Throws std::out_of_range for an index outside [0, num_particles).
  BlockMatrix(int num_particles, std::vector<std::pair<int, int>> pattern);

  int num_particles() const { return static_cast<int>(row_begin_.size()) - 1; }
  std::size_t num_blocks() const { return blocks_.size(); }

  void set_zero();

  /// Adds to block (row, column), which must be in the pattern (asserted). Any 3 x 3 expression.
  template <class Block>
  void add_block(int row, int column, const Block& block) {
    blocks_[next_slot(row, column)] += block;
  }

  /// Adds `value` times the identity to block (row, row).
  void add_to_diagonal(int row, Real value) { blocks_[diagonal_[row]].diagonal().array() += value; }

  void scale(Real factor);

  /// A += scale * B, of the same pattern (asserted).
  void add(const BlockMatrix& other, Real scale);

  Matrix3 block(int row, int column) const;  // zero outside the pattern
  const Matrix3& diagonal(int row) const { return blocks_[diagonal_[row]]; }

  /// Calls visit(column, block) for every block of the row.
  template <class Visit>
  void visit_row(int row, const Visit& visit) const {
    for (int k = row_begin_[row]; k < row_begin_[row + 1]; ++k) visit(columns_[k], blocks_[k]);
  }

  /// y += scale * A x, one column a particle.
  void add_product(const Vectors& x, Real scale, Forces y) const;

  /// The dense 3P x 3P matrix: for tests and small systems.
  Eigen::MatrixXd to_dense() const;

 private:
  std::ptrdiff_t find(int row, int column) const;
  int search(int row, int column);

  int next_slot(int row, int column) {
    if (cursor_ < slots_.size()) {
      const int slot = slots_[cursor_];
      if (columns_[slot] == column && row_begin_[row] <= slot && slot < row_begin_[row + 1]) {
        ++cursor_;
        return slot;
      }
    }
    return search(row, column);
  }

  std::vector<int> row_begin_;  // P + 1
  std::vector<int> columns_;    // sorted within a row
  std::vector<int> diagonal_;   // where it is in each row
  std::vector<Matrix3> blocks_;
  std::vector<int> slots_;  // of the blocks added since `set_zero`, in order
  std::size_t cursor_ = 0;
};

}  // namespace penalty
