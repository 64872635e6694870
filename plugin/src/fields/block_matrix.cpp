#include "penalty/fields/block_matrix.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <string>

namespace penalty {

BlockMatrix::BlockMatrix(int num_particles, std::vector<std::pair<int, int>> pattern) {
  for (auto [row, column] : pattern)
    if (row < 0 || column < 0 || row >= num_particles || column >= num_particles)
      throw std::out_of_range("block matrix: block (" + std::to_string(row) + ", " + std::to_string(column) + ") of " +
                              std::to_string(num_particles) + " particles");
  for (int i = 0; i < num_particles; ++i) pattern.emplace_back(i, i);
  std::sort(pattern.begin(), pattern.end());
  pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());
  row_begin_.assign(num_particles + 1, 0);
  columns_.reserve(pattern.size());
  for (auto [row, column] : pattern) {
    ++row_begin_[row + 1];
    columns_.push_back(column);
  }
  for (int i = 0; i < num_particles; ++i) row_begin_[i + 1] += row_begin_[i];
  blocks_.assign(columns_.size(), Matrix3::Zero());
  for (int i = 0; i < num_particles; ++i) diagonal_.push_back(static_cast<int>(find(i, i)));
}

void BlockMatrix::set_zero() {
  std::fill(blocks_.begin(), blocks_.end(), Matrix3::Zero());
  cursor_ = 0;
}

void BlockMatrix::scale(Real factor) {
  for (Matrix3& block : blocks_) block *= factor;
}

void BlockMatrix::add(const BlockMatrix& other, Real scale) {
  assert(other.columns_ == columns_ && "another pattern");
  for (std::size_t k = 0; k < blocks_.size(); ++k) blocks_[k] += scale * other.blocks_[k];
}

std::ptrdiff_t BlockMatrix::find(int row, int column) const {
  const auto begin = columns_.begin() + row_begin_[row], end = columns_.begin() + row_begin_[row + 1];
  const auto found = std::lower_bound(begin, end, column);
  return found != end && *found == column ? found - columns_.begin() : -1;
}

int BlockMatrix::search(int row, int column) {
  const std::ptrdiff_t index = find(row, column);
  assert(index >= 0 && "block outside the pattern");
  if (cursor_ < slots_.size())
    slots_[cursor_] = static_cast<int>(index);
  else
    slots_.push_back(static_cast<int>(index));
  ++cursor_;
  return static_cast<int>(index);
}

Matrix3 BlockMatrix::block(int row, int column) const {
  const std::ptrdiff_t index = find(row, column);
  return index < 0 ? Matrix3(Matrix3::Zero()) : blocks_[index];
}

void BlockMatrix::add_product(const Vectors& x, Real scale, Forces y) const {
  const Real* block = blocks_.empty() ? nullptr : blocks_.front().data();
  const Real* in = x.data();
  Real* out = y.data();
  for (int row = 0; row < num_particles(); ++row, out += 4) {
    Real sum[3] = {0, 0, 0};
    for (int k = row_begin_[row]; k < row_begin_[row + 1]; ++k, block += 9) {
      const Real* v = in + 4 * static_cast<std::size_t>(columns_[k]);
      for (int axis = 0; axis < 3; ++axis)
        sum[axis] += block[axis] * v[0] + block[3 + axis] * v[1] + block[6 + axis] * v[2];
    }
    for (int axis = 0; axis < 3; ++axis) out[axis] += scale * sum[axis];
  }
}

Eigen::MatrixXd BlockMatrix::to_dense() const {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * num_particles(), 3 * num_particles());
  for (int row = 0; row < num_particles(); ++row)
    for (int k = row_begin_[row]; k < row_begin_[row + 1]; ++k)
      dense.block<3, 3>(3 * row, 3 * columns_[k]) = blocks_[k];
  return dense;
}

}  // namespace penalty
