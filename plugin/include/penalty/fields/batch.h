// Many elements of one kind: gather, evaluate, scatter.
#pragma once
#include <array>
#include <cassert>
#include <type_traits>

#include "penalty/fields/element_batch.h"
#include "penalty/fields/kernel.h"
#include "penalty/kinds/attachment.h"
#include "penalty/kinds/enclosed_volume.h"
#include "penalty/kinds/kinds.h"
#include "penalty/kinds/shape_match.h"
#include "penalty/kinds/stable_neo_hookean.h"

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
  k.visit_stiffness(
      p, true, [](int, Real) {}, [](Real, const Gradient<Kind::num_points>&) {});
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

 private:
  // The stiffness of an element of many points is not one dense block.
  static constexpr bool is_structured = num_points == dynamic && (HasSparseHessian<Kind> || HasDiagonalAndModes<Kind> ||
                                                                  !(HasHessian<Kind> || ElasticEnergy<Kind>));

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

  /// Calls visit(e, s) for every enabled element, its points at `x` gathered into the scratch s.
  template <class Visit>
  [[gnu::always_inline]] void for_each_enabled(const Positions& x, const Visit& visit) const {
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      if (is_off(e)) continue;
      auto&& s = scratch(e);
      gather(e, x, s.points);
      visit(e, s);
    }
  }

  /// Calls visit(e, s, damping) for every element that damps and is not slack, with its damping coefficient [J s] at the damping
  /// time of the step.
  template <class Visit>
  void for_each_damped(const Positions& x, Real time, const Visit& visit) const {
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      const Real damping = damping_time(e, time) * stiffnesses_[e];
      if (!(damping > 0)) continue;
      auto&& s = scratch(e);
      gather(e, x, s.points);
      if (!is_slack(e, s.points)) visit(e, s, damping);
    }
  }

  template <class VisitBlock, class VisitTerm>
  void visit_structured(std::size_t e, Scratch& s, StiffnessModel model, const VisitBlock& visit_block,
                        const VisitTerm& visit_term) const;

  /// The modes that element e damps, with their weights in units of its damping.
  template <class Visit>
  void visit_damping_modes(std::size_t e, Scratch& s, const Visit& visit) const;

  std::vector<Stencil> stencils_;
  std::vector<Kind> kinds_;
  [[no_unique_address]] mutable std::conditional_t<num_points == dynamic, std::vector<Scratch>, Nothing> scratch_;
};

template <ElementKind Kind>
Real Batch<Kind>::energy(const Positions& x) const {
  Real sum = 0;
  for_each_enabled(
      x, [&](std::size_t e, auto& s) { sum += penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e)); });
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
  for_each_enabled(x, [&](std::size_t e, auto& s) {
    sum += energy_and_gradient(kinds_[e], stiffnesses_[e], s.points, profile(e), s.gradient);
    scatter(e, s.gradient, -1, f);
  });
  return sum;
}

template <ElementKind Kind>
Real Batch<Kind>::evolve(const Positions& x, Real duration) {
  if (!evolves()) return 0;
  Real taken = 0;
  for_each_enabled(
      x, [&](std::size_t e, auto& s) { taken += evolve_element(e, deviation(kinds_[e], s.points), duration); });
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
  for_each_enabled(x, [&](std::size_t e, auto& s) {
    const Real share =
        penalty::energy(kinds_[e], stiffnesses_[e], s.points, profile(e)) / static_cast<Real>(stencils_[e].size());
    for (const int i : stencils_[e]) energies[i] += share;
  });
}

}  // namespace penalty

#include "penalty/fields/batch_damping.h"
#include "penalty/fields/batch_stiffness.h"

namespace penalty {

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
