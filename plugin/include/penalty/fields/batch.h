// Many elements of one kind: gather, evaluate, scatter.
#pragma once
#include <array>
#include <memory>
#include <type_traits>

#include "penalty/fields/element_batch.h"
#include "penalty/fields/kernel.h"
#include "penalty/kinds/kinds.h"

namespace penalty {

/// Particle indices of one element.
template <class Kind>
using StencilOf = std::conditional_t<Kind::num_points == dynamic, std::vector<int>,
                                     std::array<int, static_cast<std::size_t>(std::max(Kind::num_points, 0))>>;

/// Elements of one kind, each a stencil of particle indices, a kind and a stiffness K [J], in packed arrays.
/// The order in which they are added is the order of evaluation: add them in mesh order, neighbours near each other.
/// Made by `make_batch` or by `PotentialField::add`. What a batch computes stands in batch_loops.h, and for the kinds
/// of the library is compiled there.
template <ElementKind Kind>
class Batch final : public ElementBatch {
 public:
  static constexpr int num_points = Kind::num_points;
  using Stencil = StencilOf<Kind>;

  /// `name` tells batches of one kind apart, in messages and in the ledger.
  explicit Batch(int num_particles, std::string name = std::string(Kind::name))
      : ElementBatch(num_particles, std::move(name), Constraint<Kind>, period_of<Kind>) {
    has_damping_modes_ = !HasRigidDamping<Kind>;
  }

  /// Throws std::invalid_argument for an index outside [0, num_particles), for equal indices and for a stiffness that
  /// is not positive and finite; the message names batch, element and value.
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

  /// For parameters that move: the target of a distance, say. The number of points stays; `AttachedBodies::refresh`
  /// after a change that makes the element stiffer.
  Kind& kind(int element) { return kinds_[ElementBatch::check(element)]; }

  Real energy(const Positions& x) const override;
  Real add_forces(const Positions& x, Forces f) const override;
  void add_forces_only(const Positions& x, Forces f) const override;
  void add_stiffness(const Positions& x, StiffnessModel model, System& stiffness) const override;
  void add_damping(const Positions& x, Real time, System& damping) const override;
  void add_damping_modes(const Positions& x, Real time, Real duration, DampingModes& modes) const override;
  void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                 Forces v) const override;
  Real evolve(const Positions& x, Real duration) override;
  void visit_elements(const Positions& x, const ElementVisitor& visit) const override;

 private:
  // The stiffness of an element of many points is not one dense block.
  static constexpr bool is_structured = num_points == dynamic && (HasSparseHessian<Kind> || HasDiagonalAndModes<Kind> ||
                                                                  !(HasHessian<Kind> || ElasticEnergy<Kind>));

  // What the evaluation of one element works in: on the stack where its size is known, else kept with the element.
  struct FixedScratch {
    Points<num_points> points, vectors;
    Gradient<num_points> gradient;
    FixedScratch() {}  // leaves them as they are: to fill them with zeros takes as long as some kinds do
  };
  struct KeptScratch : FixedScratch {
    std::vector<Real> inverse_masses;
    explicit KeptScratch(Eigen::Index n) : inverse_masses(n) {
      this->points.resize(3, n);
      this->vectors.resize(3, n);
      this->gradient.resize(3, n);
    }
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

  /// Calls visit(e, s, damping) for every element that damps and is not slack, with its damping coefficient at the damping time
  /// of the step [J s], times `duration` [s].
  template <class Visit>
  void for_each_damped(const Positions& x, Real time, Real duration, const Visit& visit) const {
    for (std::size_t e = 0; e < stencils_.size(); ++e) {
      const Real damping = damping_time(e, time) * duration * stiffnesses_[e];
      if (!(damping > 0)) continue;
      auto&& s = scratch(e);
      gather(e, x, s.points);
      if (!is_slack(e, s.points)) visit(e, s, damping);
    }
  }

  /// The places of the blocks of all elements, disabled ones too.
  void count(System& system) const;

  template <class VisitBlock, class VisitTerm>
  void visit_structured(std::size_t e, Scratch& s, StiffnessModel model, const VisitBlock& visit_block,
                        const VisitTerm& visit_term) const;

  std::vector<Stencil> stencils_;
  std::vector<Kind> kinds_;
  [[no_unique_address]] mutable std::conditional_t<num_points == dynamic, std::vector<Scratch>, Nothing> scratch_;
};

namespace detail {

/// An empty batch of the library's kind number `kind` of the list.
std::unique_ptr<ElementBatch> make_own_batch(std::size_t kind, int num_particles, std::string name);

/// Complete where batch_loops.h is included.
template <class Kind>
struct BatchLoops;

}  // namespace detail

/// An empty batch; `name` as in its constructor.
template <ElementKind Kind>
std::unique_ptr<Batch<Kind>> make_batch(int num_particles, std::string name = std::string(Kind::name)) {
  if constexpr (is_own_kind<Kind>) {
    auto batch = detail::make_own_batch(index_in<Kind, OwnKinds>, num_particles, std::move(name));
    return std::unique_ptr<Batch<Kind>>(static_cast<Batch<Kind>*>(batch.release()));
  } else {
    static_assert(
        requires { sizeof(detail::BatchLoops<Kind>); },
        "a kind that is not the library's: include <penalty/fields/batch_loops.h>");
    return std::make_unique<Batch<Kind>>(num_particles, std::move(name));
  }
}

/// A kind of the library, for whoever knows it by its name only.
struct KindEntry {
  std::string_view name;
  int num_points;  // `dynamic`: any
  std::unique_ptr<ElementBatch> (*make)(int num_particles, std::string name);
};

/// All kinds of the library, in the order of the list.
std::span<const KindEntry> own_kinds();

}  // namespace penalty
