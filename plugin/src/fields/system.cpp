#include "penalty/fields/system.h"

#include <algorithm>
#include <cmath>

namespace penalty {

void System::set_zero() {
  blocks_.set_zero();
  num_terms_ = 0;
}

RankOneTerm& System::next_term() {
  if (num_terms_ == terms_.size()) terms_.emplace_back();
  return terms_[num_terms_++];
}

void System::add_term(Real coefficient, std::span<const int> particles, const Points<dynamic>& direction) {
  if (is_counting_) return;
  RankOneTerm& term = next_term();
  term.coefficient = coefficient;
  term.particles.assign(particles.begin(), particles.end());
  term.direction = direction;
}

void System::add(const System& other) {
  blocks_.add(other.blocks_, 1);
  for (const RankOneTerm& term : other.terms()) next_term() = term;
}

void System::scale(Real factor) {
  blocks_.scale(factor);
  for (std::size_t k = 0; k < num_terms_; ++k) terms_[k].coefficient *= factor;
}

void System::add_product(const Vectors& x, Real scale, Forces y) const {
  blocks_.add_product(x, scale, y);
  for (const RankOneTerm& term : terms()) {
    Real along = 0;
    for (std::size_t k = 0; k < term.particles.size(); ++k)
      along += term.direction.col(static_cast<Eigen::Index>(k)).dot(x.col(term.particles[k]).head<3>());
    along *= scale * term.coefficient;
    for (std::size_t k = 0; k < term.particles.size(); ++k)
      y.col(term.particles[k]).head<3>() += along * term.direction.col(static_cast<Eigen::Index>(k));
  }
}

void System::add_bounds(std::span<Real> bounds) const {
  for (int i = 0; i < num_particles(); ++i)
    blocks_.visit_row(i, [&](int, const Matrix3& block) {
      // Both are no less than the spectral norm: the first is that of an outer product, the other of a multiple of 1.
      const Real rows = block.cwiseAbs().rowwise().sum().maxCoeff(),
                 columns = block.cwiseAbs().colwise().sum().maxCoeff();
      bounds[i] += std::min(block.norm(), std::sqrt(rows * columns));
    });
  for (const RankOneTerm& term : terms()) {
    if (term.coefficient < 0) continue;
    const Real sum = term.coefficient * term.direction.colwise().norm().sum();
    for (std::size_t k = 0; k < term.particles.size(); ++k)
      bounds[term.particles[k]] += sum * term.direction.col(static_cast<Eigen::Index>(k)).norm();
  }
}

void System::add_diagonal(Real scale, Forces d) const {
  for (int i = 0; i < num_particles(); ++i) d.col(i).head<3>() += scale * blocks_.diagonal(i).diagonal();
  for (const RankOneTerm& term : terms())
    for (std::size_t k = 0; k < term.particles.size(); ++k)
      d.col(term.particles[k]).head<3>() +=
          scale * term.coefficient * term.direction.col(static_cast<Eigen::Index>(k)).cwiseAbs2();
}

Eigen::MatrixXd System::to_dense() const {
  Eigen::MatrixXd dense = blocks_.to_dense();
  for (const RankOneTerm& term : terms()) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(dense.rows());
    for (std::size_t k = 0; k < term.particles.size(); ++k)
      d.segment<3>(3 * term.particles[k]) += term.direction.col(static_cast<Eigen::Index>(k));
    dense += term.coefficient * d * d.transpose();
  }
  return dense;
}

}  // namespace penalty
