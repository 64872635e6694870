// Many elements of one kind: gather, evaluate, scatter.
#pragma once
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/assembly/kernel.h"
#include "penalty/assembly/potential.h"
#include "penalty/constraints/kinds.h"

namespace penalty {

/// Elements of one constraint kind, each a stencil of particle indices, a kind and a stiffness K [J], in packed arrays.
/// The order in which they are added is the order of evaluation: add them in mesh order, neighbours near each other.
template <Constraint Kind>
class Batch final : public Potential {
 public:
  static constexpr int num_points = Kind::num_points;
  using Stencil = std::array<int, num_points>;

  explicit Batch(int num_particles) : num_particles_(num_particles) {}

  /// Throws std::invalid_argument for an index outside [0, num_particles), for equal indices and for a stiffness that is
  /// not positive and finite; the message names kind, element and value.
  void add(const Stencil& stencil, const Kind& kind, Real stiffness) {
    check(stencil, stiffness);
    stencils_.push_back(stencil);
    kinds_.push_back(kind);
    stiffnesses_.push_back(stiffness);
  }

  /// Throws what `add` would throw.
  void check(const Stencil& stencil, Real stiffness) const;

  void reserve(std::size_t size) {
    stencils_.reserve(size);
    kinds_.reserve(size);
    stiffnesses_.reserve(size);
  }

  const std::vector<Stencil>& stencils() const { return stencils_; }
  const std::vector<Kind>& kinds() const { return kinds_; }
  const std::vector<Real>& stiffnesses() const { return stiffnesses_; }

  std::string_view name() const override { return Kind::name; }
  std::size_t num_elements() const override { return stencils_.size(); }
  Real energy(const Positions& x) const override;
  Real add_forces(const Positions& x, Forces f) const override;
  void add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const override;
  void add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const override;
  void append_pattern(std::vector<std::pair<int, int>>& pattern) const override;
  void add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                             Forces df) const override;
  void add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const override;
  void add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const override;
  void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                 Forces v) const override;
  void append_values(const Positions& x, std::vector<Real>& values) const override;

 private:
  static Points<num_points> gather(const Stencil& stencil, const Positions& x) {
    return penalty::gather<num_points>(stencil, x.data());
  }
  static void scatter(const Stencil& stencil, const Gradient<num_points>& values, Real scale, Forces& f) {
    penalty::scatter<num_points>(stencil, values, scale, f.data());
  }

  int num_particles_;
  std::vector<Stencil> stencils_;
  std::vector<Kind> kinds_;
  std::vector<Real> stiffnesses_;  // K [J]
};

template <Constraint Kind>
void Batch<Kind>::check(const Stencil& stencil, Real stiffness) const {
  const auto fail = [this](const std::string& what) {
    throw std::invalid_argument(std::string(Kind::name) + " " + std::to_string(stencils_.size()) + ": " + what);
  };
  for (int k = 0; k < num_points; ++k) {
    if (stencil[k] < 0 || stencil[k] >= num_particles_)
      fail("index " + std::to_string(stencil[k]) + " is outside the " + std::to_string(num_particles_) + " particles");
    for (int l = 0; l < k; ++l)
      if (stencil[k] == stencil[l]) fail("index " + std::to_string(stencil[k]) + " appears twice");
  }
  if (!(stiffness > 0) || !std::isfinite(stiffness))
    fail("stiffness is " + to_text(stiffness) + " J, must be positive and finite");
}

template <Constraint Kind>
Real Batch<Kind>::energy(const Positions& x) const {
  Real sum = 0;
  for (std::size_t e = 0; e < stencils_.size(); ++e)
    sum += penalty::energy(kinds_[e], stiffnesses_[e], gather(stencils_[e], x));
  return sum;
}

template <Constraint Kind>
Real Batch<Kind>::add_forces(const Positions& x, Forces f) const {
  return add_penalty_forces(stencils_.data(), kinds_.data(), stiffnesses_.data(), stencils_.size(), x.data(), f.data());
}

template <Constraint Kind>
void Batch<Kind>::add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e)
    scatter(stencils_[e],
            damping_force(kinds_[e], time * stiffnesses_[e], gather(stencils_[e], x), gather(stencils_[e], v)), 1, f);
}

template <Constraint Kind>
void Batch<Kind>::add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Hessian<num_points> k = stiffness_matrix(kinds_[e], stiffnesses_[e], gather(stencils_[e], x), model);
    for (int i = 0; i < num_points; ++i)
      for (int j = 0; j < num_points; ++j)
        stiffness.add_block(stencils_[e][i], stencils_[e][j], k.template block<3, 3>(3 * i, 3 * j));
  }
}

template <Constraint Kind>
void Batch<Kind>::append_pattern(std::vector<std::pair<int, int>>& pattern) const {
  pattern.reserve(pattern.size() + stencils_.size() * num_points * num_points);
  for (const Stencil& stencil : stencils_)
    for (int row : stencil)
      for (int column : stencil) pattern.emplace_back(row, column);
}

template <Constraint Kind>
void Batch<Kind>::add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                        Forces df) const {
  Gradient<num_points> gradient;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Points<num_points> points = gather(stencils_[e], x), change = gather(stencils_[e], dx);
    if (model == StiffnessModel::gauss_newton) {
      value_and_gradient(kinds_[e], points, gradient);
      Real dc = 0;
      for (int k = 0; k < num_points; ++k) dc += gradient.col(k).dot(change.col(k));
      scatter(stencils_[e], gradient, scale * stiffnesses_[e] * dc, df);
    } else {
      gradient.reshaped() = stiffness_matrix(kinds_[e], stiffnesses_[e], points, model) * change.reshaped();
      scatter(stencils_[e], gradient, scale, df);
    }
  }
}

template <Constraint Kind>
void Batch<Kind>::add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Gradient<num_points> gradient = kinds_[e].gradient(gather(stencils_[e], x));
    scatter(stencils_[e], gradient.cwiseAbs2(), scale * stiffnesses_[e], diagonal);
  }
}

template <Constraint Kind>
void Batch<Kind>::add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const auto norms = kinds_[e].gradient(gather(stencils_[e], x)).colwise().norm().eval();
    const Real scale = stiffnesses_[e] * norms.sum();
    for (int k = 0; k < num_points; ++k) bounds[stencils_[e][k]] += scale * norms[k];
  }
}

template <Constraint Kind>
void Batch<Kind>::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                            Forces v) const {
  Gradient<num_points> gradient;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Stencil& stencil = stencils_[e];
    value_and_gradient(kinds_[e], gather(stencil, x), gradient);
    Real rate = 0, mobility = 0;  // dC/dt and dC M^-1 dCᵀ
    for (int k = 0; k < num_points; ++k) {
      rate += gradient.col(k).dot(v.col(stencil[k]).template head<3>());
      mobility += inverse_masses[stencil[k]] * gradient.col(k).squaredNorm();
    }
    const Real damping = time * duration * stiffnesses_[e];
    const Real impulse = -damping * rate / (1 + damping * mobility);
    for (int k = 0; k < num_points; ++k)
      v.col(stencil[k]).template head<3>() += inverse_masses[stencil[k]] * impulse * gradient.col(k);
  }
}

template <Constraint Kind>
void Batch<Kind>::append_values(const Positions& x, std::vector<Real>& values) const {
  values.reserve(values.size() + stencils_.size());
  for (std::size_t e = 0; e < stencils_.size(); ++e) values.push_back(kinds_[e].value(gather(stencils_[e], x)));
}

// Compiled once, in the library; the forces of these kinds for the processor that the program runs on.
template <>
Real Batch<Length>::add_forces(const Positions& x, Forces f) const;
template <>
Real Batch<TetrahedronVolume>::add_forces(const Positions& x, Forces f) const;
extern template class Batch<Length>;
extern template class Batch<TetrahedronVolume>;

}  // namespace penalty
