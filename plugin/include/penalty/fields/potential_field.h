// The potential of a body: a rest shape and the batches that remember it.
#pragma once
#include <memory>
#include <optional>
#include <type_traits>

#include "penalty/fields/batch.h"
#include "penalty/fields/phases.h"
#include "penalty/kinds/gradient_check.h"

namespace penalty {

/// What plastic flow, breaking and changes of phase have made of a field: a memento, to be kept by whoever wants to go
/// back.
struct FieldState {
  std::vector<Real> values;
};

/// A sum of potentials over the particles of one rest shape. Rest values are taken from that shape, in double, when an
/// element is added, and never change behind the caller's back.
///
/// Some potentials may be of two phases: soft ones, which act while the body is far from its rest shape, and stiff
/// ones, which act near it; see `add_soft_phase`. All others always act.
class PotentialField {
 public:
  /// `rest_positions` is 3 x P [m]. Throws std::invalid_argument, naming particle and value, if one is not finite.
  explicit PotentialField(const Eigen::Matrix3Xd& rest_positions);

  /// A field is moved to where it stays, and changed there: assigned over, it would leave those who step it with what
  /// they know of another one.
  PotentialField(PotentialField&&) noexcept = default;
  PotentialField& operator=(PotentialField&&) = delete;

  int num_particles() const { return static_cast<int>(rest_.cols()); }
  const PackedVectors& rest_positions() const { return rest_; }

  /// Adds one element a stencil, at rest in the rest shape, all of stiffness `stiffness` [J]: one batch, owned by the
  /// field. Errors are those of `Batch::add` and of the kind's `at_rest`. A kind that is not the library's own has its
  /// gradient checked against central differences, at rest and near it, and is refused if they differ. `name` is what
  /// messages and the ledger call the batch; empty: the name of the kind.
  template <ElementKind Kind>
  Batch<Kind>& add(std::span<const StencilOf<Kind>> stencils, Real stiffness, std::string name = {}) {
    return add<Kind>(stencils, std::vector<Real>(stencils.size(), stiffness), std::move(name));
  }

  /// The same with a stiffness of its own for each stencil.
  template <ElementKind Kind>
  Batch<Kind>& add(std::span<const StencilOf<Kind>> stencils, const std::vector<Real>& stiffnesses,
                   std::string name = {}) {
    return add_elements<Kind>(stencils, stiffnesses, std::move(name),
                              [](const Points<Kind::num_points>& rest) { return Kind::at_rest(rest); });
  }

  /// The same for a kind with parameters: `prototype.at_rest(points)` makes the elements.
  template <ElementKind Kind>
  Batch<Kind>& add(const Kind& prototype, std::type_identity_t<std::span<const StencilOf<Kind>>> stencils,
                   Real stiffness, std::string name = {}) {
    return add(prototype, stencils, std::vector<Real>(stencils.size(), stiffness), std::move(name));
  }
  template <ElementKind Kind>
  Batch<Kind>& add(const Kind& prototype, std::type_identity_t<std::span<const StencilOf<Kind>>> stencils,
                   const std::vector<Real>& stiffnesses, std::string name = {}) {
    return add_elements<Kind>(stencils, stiffnesses, std::move(name),
                              [&](const Points<Kind::num_points>& rest) { return prototype.at_rest(rest); });
  }

  /// The same with a prototype of its own for each stencil: `add<Kind>(prototypes, stencils, stiffnesses)`.
  template <ElementKind Kind>
  Batch<Kind>& add(std::type_identity_t<std::span<const Kind>> prototypes,
                   std::type_identity_t<std::span<const StencilOf<Kind>>> stencils,
                   const std::vector<Real>& stiffnesses, std::string name = {}) {
    if (prototypes.size() != stencils.size())
      throw std::invalid_argument((name.empty() ? std::string(Kind::name) : name) + ": " +
                                  std::to_string(prototypes.size()) + " prototypes for " +
                                  std::to_string(stencils.size()) + " stencils");
    auto next = prototypes.begin();
    return add_elements<Kind>(stencils, stiffnesses, std::move(name),
                              [&](const Points<Kind::num_points>& rest) { return (next++)->at_rest(rest); });
  }

  /// Adds any potential over the same particles.
  Potential& add(std::unique_ptr<Potential> potential);

  /// Adds all that another field over as many particles holds, with its phases. Throws std::invalid_argument for
  /// another number.
  void add(PotentialField field);

  /// What the field holds so far becomes the stiff phase, and gives way to `soft` while one of the tetrahedra is far
  /// from its rest shape. A material that resists changes of volume much more than changes of shape has rest states
  /// that are no rest shape, wound-up and folded ones, from which no force leads back; a soft one without that
  /// resistance has none that has ever been met. Solvers choose the phase before a step; the energy jumps when it
  /// changes, which they book as a change from outside. Throws std::invalid_argument for a field of another number of
  /// particles, for potentials that are of two phases already, and as PhaseSwitch.
  void add_soft_phase(std::span<const Tetrahedron> tetrahedra, PotentialField soft,
                      const PhaseThresholds& thresholds = {});

  /// Some soft phase acts.
  bool is_soft() const;
  /// Largest strain of a tetrahedron that decides on a phase, as in PhaseThresholds.
  Real largest_strain(const Positions& x) const;
  /// Chooses the phase for `x`; returns the energy that this added [J]. What broke in one phase is broken in the other
  /// when that comes to act: elements within tetrahedra that decide, all of which have lost an element. Both are then to
  /// be enabled by who mends them.
  Real choose_phase(const Positions& x);

  /// All of them, soft phases first.
  const std::vector<std::unique_ptr<Potential>>& potentials() const { return potentials_; }
  /// Whether potential k acts now.
  bool acts(std::size_t k) const { return acts(phases_[k]); }

  /// The first batch of this kind, or null; of two phases that of the stiff one.
  template <ElementKind Kind>
  Batch<Kind>* find() {
    return static_cast<Batch<Kind>*>(find_if([](const Potential& p) { return dynamic_cast<const Batch<Kind>*>(&p); }));
  }
  template <ElementKind Kind>
  const Batch<Kind>* find() const {
    return const_cast<PotentialField*>(this)->find<Kind>();
  }
  /// The first batch of this name, or null; of two phases that of the stiff one.
  ElementBatch* find(std::string_view name);
  const ElementBatch* find(std::string_view name) const { return const_cast<PotentialField*>(this)->find(name); }

  /// The same, but where there is no such batch std::invalid_argument says what there is.
  template <ElementKind Kind>
  Batch<Kind>& batch() {
    if (Batch<Kind>* found = find<Kind>()) return *found;
    fail_to_find("no batch of the kind \"" + std::string(Kind::name) + "\"");
  }
  template <ElementKind Kind>
  const Batch<Kind>& batch() const {
    return const_cast<PotentialField*>(this)->batch<Kind>();
  }
  ElementBatch& batch(std::string_view name);
  const ElementBatch& batch(std::string_view name) const { return const_cast<PotentialField*>(this)->batch(name); }

  // Sums over the potentials that act; as in Potential. Taut stiffness is that of the stiff phases: what the stable step
  // is judged by must hold in both.
  std::size_t num_elements() const;
  Real energy(const Positions& x) const;
  Real add_forces(const Positions& x, Forces f) const;
  void add_forces_only(const Positions& x, Forces f) const;
  void add_stiffness(const Positions& x, StiffnessModel model, System& stiffness) const;
  void add_damping(const Positions& x, Real time, System& damping) const;
  void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration, Forces v) const;
  bool damps() const;
  bool evolves() const;
  Real evolve(const Positions& x, Real duration);
  std::uint64_t stiffness_version() const;

  /// Of all potentials; elements of a phase that does not act count as disabled.
  void visit_elements(const Positions& x, const ElementVisitor& visit) const;

  FieldState state() const;
  void get_state(FieldState& state) const;  // without allocation if it has held as much before
  /// Throws std::invalid_argument for the state of another field; this one is then left as it was, or partly set.
  void set_state(const FieldState& state);

 private:
  // Which switch decides whether a potential acts, and in which phase; of none: always.
  struct Phase {
    int decided_by = -1;
    bool soft = false;
  };

  bool acts(Phase phase) const { return phase.decided_by < 0 || switches_[phase.decided_by].is_far == phase.soft; }

  template <class Visit>
  void for_each_acting(const Visit& visit) const {
    for (std::size_t k = 0; k < potentials_.size(); ++k)
      if (acts(k)) visit(*potentials_[k]);
  }
  template <class Visit>
  void for_each_stiff(const Visit& visit) const {
    for (std::size_t k = 0; k < potentials_.size(); ++k)
      if (!phases_[k].soft) visit(*potentials_[k]);
  }

  // The first that `test` is true of, soft phases last.
  template <class Test>
  Potential* find_if(const Test& test) {
    for (const bool soft : {false, true})
      for (std::size_t k = 0; k < potentials_.size(); ++k)
        if (phases_[k].soft == soft && test(*potentials_[k])) return potentials_[k].get();
    return nullptr;
  }
  [[noreturn]] void fail_to_find(const std::string& what) const;

  template <ElementKind Kind, class AtRest>
  Batch<Kind>& add_elements(std::span<const StencilOf<Kind>> stencils, const std::vector<Real>& stiffnesses,
                            std::string name, const AtRest& at_rest);
  void check_size(const PotentialField& other, const char* what) const;
  void note_breaks();
  void break_what_is_lost(int phases, const Positions& x);

  PackedVectors rest_;
  std::vector<std::unique_ptr<Potential>> potentials_;
  std::vector<Phase> phases_;  // of each potential
  std::vector<PhaseSwitch> switches_;
  std::optional<BreakCount> noted_;  // that switches know of
};

template <ElementKind Kind, class AtRest>
Batch<Kind>& PotentialField::add_elements(std::span<const StencilOf<Kind>> stencils,
                                          const std::vector<Real>& stiffnesses, std::string name,
                                          const AtRest& at_rest) {
  if (name.empty()) name = Kind::name;
  if (stiffnesses.size() != stencils.size())
    throw std::invalid_argument(name + ": " + std::to_string(stiffnesses.size()) + " stiffnesses for " +
                                std::to_string(stencils.size()) + " stencils");
  auto batch = make_batch<Kind>(num_particles(), name);
  batch->reserve(stencils.size());
  for (std::size_t e = 0; e < stencils.size(); ++e) {
    const std::string label = name + " " + std::to_string(e);
    try {
      batch->check(stencils[e], stiffnesses[e]);
      Points<Kind::num_points> points(3, static_cast<Eigen::Index>(stencils[e].size()));
      gather_points(stencils[e], rest_.data(), points);
      const Kind kind = at_rest(points);
      if constexpr (!is_own_kind<Kind>) check_gradient(kind, points, label);
      batch->add(stencils[e], kind, stiffnesses[e]);
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      throw std::invalid_argument(what.starts_with(label + ":") ? what : label + ": " + what);
    }
  }
  Batch<Kind>& added = *batch;
  add(std::unique_ptr<Potential>(std::move(batch)));
  return added;
}

}  // namespace penalty
