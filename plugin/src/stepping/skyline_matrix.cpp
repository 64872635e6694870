#include "skyline_matrix.h"

#include <algorithm>
#include <cmath>

namespace penalty {

void SkylineMatrix::clear() {
  rows_.clear();
  entries_.clear();
}

void SkylineMatrix::add_row(Eigen::Index first) {
  rows_.push_back({first, static_cast<Eigen::Index>(entries_.size())});
  entries_.resize(entries_.size() + static_cast<std::size_t>(size() - first), 0);
}

Real SkylineMatrix::factor(Real least) {
  Real smallest = 1;
  for (Eigen::Index i = 0; i < size(); ++i) {
    const Eigen::Index first = rows_[i].first;
    const Real diagonal = at(i, i);
    for (Eigen::Index j = first; j < i; ++j) {
      const Eigen::Index from = std::max(first, rows_[j].first);
      at(i, j) = (at(i, j) - part(i, from, j).dot(part(j, from, j))) / at(j, j);
    }
    const Real left = std::max(diagonal - part(i, first, i).squaredNorm(), least * diagonal);
    smallest = std::min(smallest, left / diagonal);
    at(i, i) = std::sqrt(left);
  }
  return smallest;
}

void SkylineMatrix::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const Eigen::Index first = rows_[i].first;
    x[i] = (x[i] - part(i, first, i).dot(x.segment(first, i - first))) / part(i, i, i + 1)[0];
  }
  for (Eigen::Index i = size() - 1; i >= 0; --i) {
    const Eigen::Index first = rows_[i].first;
    x[i] /= part(i, i, i + 1)[0];
    x.segment(first, i - first) -= x[i] * part(i, first, i);
  }
}

}  // namespace penalty
