// Systems of equations whose unknowns meet few others.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "penalty/math/types.h"

namespace penalty {

/// A symmetric positive definite matrix of which each row is kept from its first entry to the diagonal: what is left of
/// that stays zero in its factors, too. In the order of a chain that is a narrow band.
class SkylineMatrix {
 public:
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows_.size()); }

  /// Takes all rows away, but not their memory.
  void clear();

  /// Appends a row of zeros that begins at column `first`.
  void add_row(Eigen::Index first);
  Eigen::Index first_of(Eigen::Index row) const { return rows_[row].first; }

  /// first_of(row) <= column <= row.
  Real& at(Eigen::Index row, Eigen::Index column) { return entries_[rows_[row].begin + column - rows_[row].first]; }

  /// Makes L of A = L Lᵀ. What round-off leaves of a row that is a sum of others is taken for `least` of its diagonal.
  /// Returns the smallest share of a diagonal that the rows before leave.
  Real factor(Real least);

  /// Makes A⁻¹ x of x. After `factor`.
  void solve(Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  struct Row {
    Eigen::Index first, begin;  // column, and where it stands among the entries
  };

  /// Columns `from` to `to` of a row.
  auto part(Eigen::Index row, Eigen::Index from, Eigen::Index to) const {
    return Eigen::Map<const Eigen::VectorXd>(entries_.data() + rows_[row].begin + from - rows_[row].first, to - from);
  }

  std::vector<Row> rows_;
  std::vector<Real> entries_;
};

}  // namespace penalty
