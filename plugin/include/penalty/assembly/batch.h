// Many elements of one kind: gather, evaluate, scatter.
#pragma once
#include <array>
#include <cassert>
#include <type_traits>

#include "penalty/assembly/element_batch.h"
#include "penalty/assembly/kernel.h"
#include "penalty/constraints/attachment.h"
#include "penalty/constraints/enclosed_volume.h"
#include "penalty/constraints/kinds.h"
#include "penalty/constraints/shape_match.h"
#include "penalty/energy/stable_neo_hookean.h"

namespace penalty {

template <class Kind, class List>
inline constexpr bool is_in = false;
template <class Kind, class... Kinds>
inline constexpr bool is_in<Kind, KindList<Kinds...>> = (std::is_same_v<Kind, Kinds> || ...);

/// The kinds that the library compiles and its tests cover; any other is a user's own.
template <class Kind>
inline constexpr bool is_own_kind =
    is_in<Kind, AllKinds> || is_in<Kind, KindList<Attachment, EnclosedVolume, ShapeMatch, StableNeoHookean>>;

/// `add_element_forces`, compiled in the library for the processor that the program runs on; own kinds only.
template <ElementKind Kind>
Real add_own_element_forces(const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils,
                            const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x, Real* f);

/// What C jumps by where an angle comes full circle; 0 of any other kind.
template <class Kind>
inline constexpr Real period_of = [] {
  if constexpr (requires { Kind::period; })
    return Kind::period;
  else
    return Real(0);
}();

/// Particle indices of one element.
template <class Kind>
using StencilOf = std::conditional_t<Kind::num_points == dynamic, std::vector<int>,
                                     std::array<int, static_cast<std::size_t>(std::max(Kind::num_points, 0))>>;

/// A constraint of any number of points whose Hessian couples only few pairs of them: `visit_hessian_blocks(p, visit)` calls
/// visit(i, j, block), `visit_hessian_pattern(visit)` calls visit(i, j).
template <class Kind>
concept HasSparseHessian = Constraint<Kind> && requires(const Kind k, const Points<Kind::num_points>& p) {
  k.visit_hessian_blocks(p, [](int, int, const Matrix3&) {});
  k.visit_hessian_pattern([](int, int) {});
};

/// An energy of any number of points whose Hessian is a diagonal and few rank-one terms.
template <class Kind>
concept HasDiagonalAndModes = ElasticEnergy<Kind> && requires(const Kind k, const Points<Kind::num_points>& p) {
  k.visit_stiffness(p, true, [](int, Real) {}, [](Real, const Gradient<Kind::num_points>&) {});
};

/// Elements of one kind, each a stencil of particle indices, a kind and a stiffness K [J], in packed arrays.
/// The order in which they are added is the order of evaluation: add them in mesh order, neighbours near each other.
template <ElementKind Kind>
class Batch final : public ElementBatch {
 public:
  static constexpr int num_points = Kind::num_points;
  using Stencil = StencilOf<Kind>;

  /// `name` tells batches of one kind apart, in messages and in the ledger.
  explicit Batch(int num_particles, std::string name = std::string(Kind::name))
      : ElementBatch(num_particles, std::move(name), Constraint<Kind>, period_of<Kind>) {}

  /// Throws std::invalid_argument for an index outside [0, num_particles), for equal indices and for a stiffness that is
  /// not positive and finite; the message names batch, element and value.
  void add(const Stencil& stencil, const Kind& kind, Real stiffness) {
    check(stencil, stiffness);
    stencils_.push_back(stencil);
    kinds_.push_back(kind);
    if constexpr (num_points == dynamic) scratch_.emplace_back(static_cast<Eigen::Index>(stencil.size()));
    append_element(stiffness);
  }

  /// Throws what `add` would throw.
  void check(const Stencil& stencil, Real stiffness) const {
    check_stencil(stencil);
    check_stiffness(num_elements(), stiffness);
  }

  void reserve(std::size_t size) {
    stencils_.reserve(size);
    kinds_.reserve(size);
    stiffnesses_.reserve(size);
  }

  const std::vector<Stencil>& stencils() const { return stencils_; }
  const std::vector<Kind>& kinds() const { return kinds_; }
  const std::vector<Real>& stiffnesses() const { return stiffnesses_; }  // 0 of a disabled element

  /// For parameters that move: the target of a distance, say. The number of points stays; `AttachedBodies::refresh` after
  /// a change that makes the element stiffer.
  Kind& kind(int element) { return kinds_[ElementBatch::check(element)]; }

  Real energy(const Positions& x) const override;
  Real add_forces(const Positions& x, Forces f) const override;
  void add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const override;
  void add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const override;
  void append_pattern(std::vector<std::pair<int, int>>& pattern) const override;
  void append_rank_one_terms(const Positions& x, StiffnessModel model, std::vector<RankOneTerm>& terms) const override;
  void add_damping(const Positions& x, Real time, BlockMatrix& damping) const override;
  void append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const override;
  void add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                             Forces df) const override;
  void add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const override;
  void add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const override;
  void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                 Forces v) const override;
  Real evolve(const Positions& x, Real duration) override;
  void append_strains(const Positions& x, std::vector<Real>& strains) const override;
  void append_energies(const Positions& x, std::vector<Real>& energies) const override;
  void add_particle_energies(const Positions& x, std::span<Real> energies) const override;
  void append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const override;

 private:
  // The stiffness of an element of many points is not one dense block.
  static constexpr bool is_structured =
      num_points == dynamic && (HasSparseHessian<Kind> || HasDiagonalAndModes<Kind> || !(HasHessian<Kind> || ElasticEnergy<Kind>));

  // What the evaluation of one element works in: on the stack where its size is known, else kept with the element.
  struct FixedScratch {
    Points<num_points> points, vectors;
    Gradient<num_points> gradient;
  };
  struct KeptScratch : FixedScratch {
    std::vector<Real> inverse_masses;
    explicit KeptScratch(Eigen::Index n) : FixedScratch{{3, n}, {3, n}, {3, n}}, inverse_masses(n) {}
  };
  using Scratch = std::conditional_t<num_points == dynamic, KeptScratch, FixedScratch>;
  struct Nothing {};

  decltype(auto) scratch(std::size_t e) const {
    if constexpr (num_points == dynamic)
      return static_cast<Scratch&>(scratch_[e]);
    else
      return Scratch();
  }

  bool is_off(std::size_t e) const { return !(stiffnesses_[e] > 0); }

  [[gnu::always_inline]] void gather(std::size_t e, const Positions& x, Points<num_points>& points) const {
    gather_points(stencils_[e], x.data(), points);
  }
  [[gnu::always_inline]] void scatter(std::size_t e, const Gradient<num_points>& values, Real scale, Forces& f) const {
    scatter_points(stencils_[e], values, scale, f.data());
  }

  bool is_slack(std::size_t e, Real c, StiffnessModel model) const {
    return model != StiffnessModel::taut && profile(e).is_slack(c);
  }
  bool is_slack(std::size_t e, const Points<num_points>& points) const {
    return !is_plain() && profile(e).is_slack(deviation(kinds_[e], points));
  }

  template <class VisitBlock, class VisitTerm>
  void visit_structured(std::size_t e, Scratch& s, StiffnessModel model, const VisitBlock& visit_block,
                        const VisitTerm& visit_term) const;

  /// The modes that element e damps, with their weights in units of its damping; none of a slack element.
  template <class Visit>
  void visit_damping_modes(std::size_t e, Scratch& s, const Visit& visit) const;

  std::vector<Stencil> stencils_;
  std::vector<Kind> kinds_;
  [[no_unique_address]] mutable std::conditional_t<num_points == dynamic, std::vector<Scratch>, Nothing> scratch_;
};

template <ElementKind Kind>
Real Batch<Kind>::energy(const Positions& x) const {
  Real sum = 0;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    sum += penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e));
  }
  return sum;
}

template <ElementKind Kind>
Real Batch<Kind>::add_forces(const Positions& x, Forces f) const {
  if constexpr (num_points != dynamic) {
    if (is_plain()) {
      const Stencil* stencils = stencils_.data();
      const Kind* kinds = kinds_.data();
      if constexpr (is_own_kind<Kind>)
        return add_own_element_forces(stencils, kinds, stiffnesses_.data(), stencils_.size(), x.data(), f.data());
      else
        return add_element_forces(stencils, kinds, stiffnesses_.data(), stencils_.size(), x.data(), f.data());
    }
  }
  Real sum = 0;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    sum += energy_and_gradient(kinds_[e], stiffnesses_[e], s.points, profile(e), s.gradient);
    scatter(e, s.gradient, -1, f);
  }
  return sum;
}

template <ElementKind Kind>
void Batch<Kind>::add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Real damping = damping_time(e, time) * stiffnesses_[e];
    if (!(damping > 0)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    if (is_slack(e, s.points)) continue;
    gather(e, v, s.vectors);
    scatter(e, damping_force(kinds_[e], damping, s.points, s.vectors), 1, f);
  }
}

/// Blocks and rank-one terms of one element; the sum of both is its stiffness.
template <ElementKind Kind>
template <class VisitBlock, class VisitTerm>
void Batch<Kind>::visit_structured(std::size_t e, Scratch& s, StiffnessModel model, const VisitBlock& visit_block,
                                   const VisitTerm& visit_term) const {
  const Kind& kind = kinds_[e];
  const Real k = stiffnesses_[e];
  const Profile profile = this->profile(e);
  if constexpr (Constraint<Kind>) {
    const Real c = value_and_gradient(kind, s.points, s.gradient);
    if (is_slack(e, c, model)) return;
    visit_term(k, s.gradient);
    // The Hessian of a constraint of many points is projected as a whole or not at all: psd leaves it out.
    if constexpr (HasSparseHessian<Kind>)
      if (model == StiffnessModel::exact)
        kind.visit_hessian_blocks(s.points, [&](int i, int j, const Matrix3& block) {
          visit_block(i, j, k * profile.strain(c) * block);
        });
  } else {
    const Real psi = kind.energy_and_gradient(s.points, s.gradient);
    const Real c = std::sqrt(2 * std::max<Real>(psi, 0));
    if (is_slack(e, c, model)) return;
    Real share = 1;
    if (!profile.is_plain() && model != StiffnessModel::taut) {
      if (!(c > 0)) return;
      share = profile.strain(c) / c;
      if (share < 0 && model != StiffnessModel::exact) share = 0;
      if (share < 1) visit_term(k * (1 - share) / (c * c), s.gradient);
    }
    kind.visit_stiffness(
        s.points, model != StiffnessModel::exact,
        [&](int i, Real value) { visit_block(i, i, Matrix3::Identity() * (k * share * value)); },
        [&](Real coefficient, const Gradient<num_points>& mode) { visit_term(k * share * coefficient, mode); });
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Stencil& stencil = stencils_[e];
    if constexpr (is_structured) {
      visit_structured(
          e, s, model, [&](int i, int j, const Matrix3& block) { stiffness.add_block(stencil[i], stencil[j], block); },
          [](Real, const Gradient<num_points>&) {});
    } else {
      const Hessian<num_points> k = stiffness_matrix(kinds_[e], stiffnesses_[e], s.points, model, profile(e));
      const int n = static_cast<int>(stencil.size());
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          stiffness.add_block(stencil[i], stencil[j], k.template block<3, 3>(3 * i, 3 * j));
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::append_pattern(std::vector<std::pair<int, int>>& pattern) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Stencil& stencil = stencils_[e];
    if constexpr (is_structured) {
      if constexpr (HasSparseHessian<Kind>)
        kinds_[e].visit_hessian_pattern([&](int i, int j) { pattern.emplace_back(stencil[i], stencil[j]); });
      // The diagonal is in every pattern.
    } else {
      for (const int row : stencil)
        for (const int column : stencil) pattern.emplace_back(row, column);
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::append_rank_one_terms(const Positions& x, StiffnessModel model, std::vector<RankOneTerm>& terms) const {
  if constexpr (is_structured)
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      if (is_off(e)) continue;
      Scratch& s = scratch_[e];
      gather(e, x, s.points);
      visit_structured(
          e, s, model, [](int, int, const Matrix3&) {},
          [&](Real coefficient, const Gradient<num_points>& mode) { terms.push_back({coefficient, stencils_[e], mode}); });
    }
}

template <ElementKind Kind>
void Batch<Kind>::add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                        Forces df) const {
  const bool bare = model == StiffnessModel::gauss_newton || model == StiffnessModel::taut;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    gather(e, dx, s.vectors);
    const Stencil& stencil = stencils_[e];
    if constexpr (is_structured) {
      visit_structured(
          e, s, model,
          [&](int i, int j, const Matrix3& block) {
            df.col(stencil[i]).template head<3>() += scale * (block * s.vectors.col(j));
          },
          [&](Real coefficient, const Gradient<num_points>& mode) {
            scatter(e, mode, scale * coefficient * mode.cwiseProduct(s.vectors).sum(), df);
          });
    } else if (Constraint<Kind> && bare) {
      if constexpr (Constraint<Kind>) {
        const Real c = value_and_gradient(kinds_[e], s.points, s.gradient);
        if (is_slack(e, c, model)) continue;
        Real dc = 0;
        for (Eigen::Index k = 0; k < s.gradient.cols(); ++k) dc += s.gradient.col(k).dot(s.vectors.col(k));
        scatter(e, s.gradient, scale * stiffnesses_[e] * dc, df);
      }
    } else {
      s.gradient.reshaped() =
          stiffness_matrix(kinds_[e], stiffnesses_[e], s.points, model, profile(e)) * s.vectors.reshaped();
      scatter(e, s.gradient, scale, df);
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Stencil& stencil = stencils_[e];
    if constexpr (is_structured) {
      visit_structured(
          e, s, StiffnessModel::gauss_newton,
          [&](int i, int j, const Matrix3& block) {
            if (i == j) diagonal.col(stencil[i]).template head<3>() += scale * block.diagonal();
          },
          [&](Real coefficient, const Gradient<num_points>& mode) {
            scatter(e, mode.cwiseAbs2(), scale * coefficient, diagonal);
          });
    } else if constexpr (Constraint<Kind>) {
      const Real c = value_and_gradient(kinds_[e], s.points, s.gradient);
      if (!is_slack(e, c, StiffnessModel::gauss_newton))
        scatter(e, s.gradient.cwiseAbs2(), scale * stiffnesses_[e], diagonal);
    } else {
      const Hessian<num_points> k =
          stiffness_matrix(kinds_[e], stiffnesses_[e], s.points, StiffnessModel::gauss_newton, profile(e));
      s.gradient.reshaped() = k.diagonal();
      scatter(e, s.gradient, scale, diagonal);
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Stencil& stencil = stencils_[e];
    const auto add_rank_one = [&](Real coefficient, const Gradient<num_points>& mode) {
      const Real sum = mode.colwise().norm().sum();
      for (Eigen::Index k = 0; k < mode.cols(); ++k)
        bounds[stencil[k]] += std::abs(coefficient) * sum * mode.col(k).norm();
    };
    if constexpr (is_structured) {
      visit_structured(
          e, s, StiffnessModel::taut,
          [&](int i, int, const Matrix3& block) { bounds[stencil[i]] += block.norm() / std::sqrt(3.0); },
          [&](Real coefficient, const Gradient<num_points>& mode) {
            if (coefficient > 0) add_rank_one(coefficient, mode);  // the others only lower the eigenvalues
          });
    } else if constexpr (Constraint<Kind>) {
      s.gradient = kinds_[e].gradient(s.points);
      add_rank_one(stiffnesses_[e], s.gradient);
    } else {
      const Hessian<num_points> k =
          stiffness_matrix(kinds_[e], stiffnesses_[e], s.points, StiffnessModel::taut, profile(e));
      const int n = static_cast<int>(stencil.size());
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) bounds[stencil[i]] += k.template block<3, 3>(3 * i, 3 * j).norm();
    }
  }
}

template <ElementKind Kind>
template <class Visit>
void Batch<Kind>::visit_damping_modes(std::size_t e, Scratch& s, const Visit& visit) const {
  if (is_slack(e, s.points)) return;
  if constexpr (Constraint<Kind>) {
    value_and_gradient(kinds_[e], s.points, s.gradient);
    visit(1, s.gradient);
  } else if constexpr (HasDampingModes<Kind>) {
    kinds_[e].visit_damping_modes(s.points, visit);
  } else {
    const Real psi = kinds_[e].energy_and_gradient(s.points, s.gradient);
    if (psi > 0) visit(1 / (2 * psi), s.gradient);
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_damping(const Positions& x, Real time, BlockMatrix& matrix) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Real damping = damping_time(e, time) * stiffnesses_[e];
    if (!(damping > 0)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Stencil& stencil = stencils_[e];
    if constexpr (HasRigidDamping<Kind>) {
      if (is_slack(e, s.points)) continue;
      kinds_[e].visit_damping(
          s.points,
          [&](int i, Real value) {
            matrix.add_block(stencil[i], stencil[i], Matrix3::Identity() * (damping * value));
          },
          [](Real, const Gradient<num_points>&) {});
    } else if constexpr (num_points != dynamic) {
      Hessian<num_points> d = Hessian<num_points>::Zero();
      visit_damping_modes(e, s, [&](Real weight, const Gradient<num_points>& mode) {
        d.noalias() += (damping * weight) * mode.reshaped() * mode.reshaped().transpose();
      });
      for (int i = 0; i < num_points; ++i)
        for (int j = 0; j < num_points; ++j)
          matrix.add_block(stencil[i], stencil[j], d.template block<3, 3>(3 * i, 3 * j));
    }
  }
}

template <ElementKind Kind>
void Batch<Kind>::append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const {
  if constexpr (num_points == dynamic)
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      const Real damping = damping_time(e, time) * stiffnesses_[e];
      if (!(damping > 0)) continue;
      Scratch& s = scratch_[e];
      gather(e, x, s.points);
      const auto append = [&](Real weight, const Gradient<num_points>& mode) {
        terms.push_back({damping * weight, stencils_[e], mode});
      };
      if constexpr (HasRigidDamping<Kind>) {
        if (!is_slack(e, s.points)) kinds_[e].visit_damping(s.points, [](int, Real) {}, append);
      } else
        visit_damping_modes(e, s, append);
    }
}

template <ElementKind Kind>
void Batch<Kind>::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                            Forces v) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    const Real damping = damping_time(e, time) * duration * stiffnesses_[e];
    if (!(damping > 0)) continue;
    auto&& s = scratch(e);
    const Stencil& stencil = stencils_[e];
    gather(e, x, s.points);
    if constexpr (HasRigidDamping<Kind>) {
      if (is_slack(e, s.points)) continue;
      for (std::size_t k = 0; k < stencil.size(); ++k) s.inverse_masses[k] = inverse_masses[stencil[k]];
      gather_points(stencil, v.data(), s.vectors);
      kinds_[e].damp(s.points, s.inverse_masses, damping, s.vectors);
      for (std::size_t k = 0; k < stencil.size(); ++k)
        v.col(stencil[k]).template head<3>() = s.vectors.col(static_cast<Eigen::Index>(k));
    } else {
      visit_damping_modes(e, s, [&](Real weight, const Gradient<num_points>& gradient) {
        Real rate = 0, mobility = 0;  // dC/dt and dC M^-1 dCᵀ
        for (Eigen::Index k = 0; k < gradient.cols(); ++k) {
          rate += gradient.col(k).dot(v.col(stencil[k]).template head<3>());
          mobility += inverse_masses[stencil[k]] * gradient.col(k).squaredNorm();
        }
        const Real impulse = -damping * weight * rate / (1 + damping * weight * mobility);
        for (Eigen::Index k = 0; k < gradient.cols(); ++k)
          v.col(stencil[k]).template head<3>() += inverse_masses[stencil[k]] * impulse * gradient.col(k);
      });
    }
  }
}

template <ElementKind Kind>
Real Batch<Kind>::evolve(const Positions& x, Real duration) {
  if (!evolves()) return 0;
  Real taken = 0;
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    taken += evolve_element(e, deviation(kinds_[e], s.points), duration);
  }
  return taken;
}

template <ElementKind Kind>
void Batch<Kind>::append_strains(const Positions& x, std::vector<Real>& strains) const {
  strains.reserve(strains.size() + stencils_.size());
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    auto&& s = scratch(e);
    gather(e, x, s.points);
    strains.push_back(is_off(e) ? 0 : profile(e).strain(deviation(kinds_[e], s.points)));
  }
}

template <ElementKind Kind>
void Batch<Kind>::append_energies(const Positions& x, std::vector<Real>& energies) const {
  energies.reserve(energies.size() + stencils_.size());
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    auto&& s = scratch(e);
    gather(e, x, s.points);
    energies.push_back(is_off(e) ? 0 : penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e)));
  }
}

template <ElementKind Kind>
void Batch<Kind>::add_particle_energies(const Positions& x, std::span<Real> energies) const {
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Real share = penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e)) / static_cast<Real>(stencils_[e].size());
    for (const int i : stencils_[e]) energies[i] += share;
  }
}

template <ElementKind Kind>
void Batch<Kind>::append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const {
  LedgerEntry entry{.name = name(), .num_elements = num_elements()};
  for (std::size_t e = 0; e < stencils_.size(); ++e) {
    if (is_off(e)) continue;
    auto&& s = scratch(e);
    gather(e, x, s.points);
    const Real strain = std::abs(profile(e).strain(deviation(kinds_[e], s.points)));
    entry.energy += penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e));
    entry.mean_strain += strain;
    if (entry.num_enabled++ == 0 || strain > entry.largest_strain) {
      entry.largest_strain = strain;
      entry.largest_element = static_cast<int>(e);
    }
  }
  if (entry.num_enabled > 0) entry.mean_strain /= static_cast<Real>(entry.num_enabled);
  ledger.push_back(entry);
}

// Compiled once, in the library.
extern template class Batch<Length>;
extern template class Batch<TriangleArea>;
extern template class Batch<TetrahedronVolume>;
extern template class Batch<CornerAngle>;
extern template class Batch<TetrahedronDihedralAngle>;
extern template class Batch<BendingAngle>;
extern template class Batch<Distance>;
extern template class Batch<Attachment>;
extern template class Batch<EnclosedVolume>;
extern template class Batch<ShapeMatch>;
extern template class Batch<StableNeoHookean>;

}  // namespace penalty
