// Where potentials put their stiffness and their damping: sparse blocks, and terms that are too dense for them.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "penalty/fields/block_matrix.h"

namespace penalty {

/// coefficient * d dᵀ, column k of d belongs to particles[k].
struct RankOneTerm {
  Real coefficient;  // of either sign
  std::vector<int> particles;
  Points<dynamic> direction;
};

/// A symmetric matrix over the coordinates of the particles: the sum of 3 x 3 blocks and of rank-one terms, which stand
/// for elements of many points, each coupled with every other. What walks over the elements and adds blocks serves
/// twice: once to count them, see `with_pattern`, and then at every step to add their values. Without allocation once a
/// walk of the same elements has been made.
class System {
 public:
  System() : blocks_(0, {}) {}
  explicit System(BlockMatrix blocks) : blocks_(std::move(blocks)) {}

  /// A system of zeros whose pattern holds all blocks that `walk(system)` adds. Throws std::out_of_range for a block
  /// outside the particles.
  template <class Walk>
  static System with_pattern(int num_particles, const Walk& walk) {
    System system;
    system.is_counting_ = true;
    walk(system);
    system.is_counting_ = false;
    system.num_terms_ = 0;
    system.blocks_ = BlockMatrix(num_particles, std::exchange(system.pattern_, {}));
    return system;
  }

  /// Only the places of blocks count: whoever adds them may leave out the values, and must not leave out disabled
  /// elements.
  bool is_counting() const { return is_counting_; }

  int num_particles() const { return blocks_.num_particles(); }
  const BlockMatrix& blocks() const { return blocks_; }
  std::span<const RankOneTerm> terms() const { return {terms_.data(), num_terms_}; }

  void set_zero();

  /// Adds to block (row, column), which must be in the pattern (asserted). Any 3 x 3 expression.
  template <class Block>
  void add_block(int row, int column, const Block& block) {
    if (is_counting_)
      count(row, column);
    else
      blocks_.add_block(row, column, block);
  }

  /// Adds the blocks of an element that couples all its points: block (i, j) of `dense` is that of stencil[i] and
  /// stencil[j].
  template <class Stencil, class Dense>
  void add_dense(const Stencil& stencil, const Dense& dense) {
    const int n = static_cast<int>(stencil.size());
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) add_block(stencil[i], stencil[j], dense.template block<3, 3>(3 * i, 3 * j));
  }

  /// The places of blocks that will be added, one by one or as by `add_dense`.
  void count(int row, int column) { pattern_.emplace_back(row, column); }
  template <class Stencil>
  void count_dense(const Stencil& stencil) {
    for (const int row : stencil)
      for (const int column : stencil) count(row, column);
  }

  /// Adds `value` times the identity to block (row, row).
  void add_to_diagonal(int row, Real value) { blocks_.add_to_diagonal(row, value); }

  /// Adds coefficient * d dᵀ.
  void add_term(Real coefficient, std::span<const int> particles, const Points<dynamic>& direction);

  /// A += B, of the same pattern (asserted).
  void add(const System& other);
  void scale(Real factor);

  /// y += scale * A x, one column a particle.
  void add_product(const Vectors& x, Real scale, Forces y) const;

  /// bounds[i] += sum_j |A_ij|, the Gershgorin row sums of the blocks, of rank-one terms |c| |d_i| sum_j |d_j|: no
  /// eigenvalue of M^-1 A is above the largest bounds[i] / m_i. Terms of negative coefficient, which only lower
  /// eigenvalues, are left out.
  void add_bounds(std::span<Real> bounds) const;

  /// d += scale * the diagonal of A.
  void add_diagonal(Real scale, Forces d) const;

  /// The dense 3P x 3P matrix: for tests and small systems.
  Eigen::MatrixXd to_dense() const;

 private:
  RankOneTerm& next_term();

  BlockMatrix blocks_;
  std::vector<RankOneTerm> terms_;  // the first `num_terms_` count, the others are room
  std::size_t num_terms_ = 0;
  bool is_counting_ = false;
  std::vector<std::pair<int, int>> pattern_;
};

}  // namespace penalty
