// The potential of a body: a rest shape and the batches that remember it.
#pragma once
#include <memory>
#include <optional>
#include <type_traits>

#include "penalty/energy/material.h"
#include "penalty/fields/batch.h"
#include "penalty/fields/topology.h"
#include "penalty/kinds/gradient_check.h"

namespace penalty {

/// A sum of potentials over the particles of one rest shape. Rest values are taken from that shape, in double, when an
/// element is added, and never change behind the caller's back.
class PotentialField final : public Potential {
 public:
  /// `rest_positions` is 3 x P [m]. Throws std::invalid_argument, naming particle and value, if one is not finite.
  explicit PotentialField(const Eigen::Matrix3Xd& rest_positions);

  /// A field goes to whoever owns it by construction; one that is in use is changed, never assigned to.
  PotentialField(PotentialField&&) = default;
  PotentialField& operator=(PotentialField&&) = delete;

  int num_particles() const { return static_cast<int>(rest_.cols()); }
  const PackedVectors& rest_positions() const { return rest_; }

  /// Adds one element a stencil, at rest in the rest shape, all of stiffness `stiffness` [J]: one batch, owned by the field.
  /// Errors are those of `Batch::add` and of the kind's `at_rest`. A constraint that is not the library's own has its gradient
  /// checked against central differences, at rest and near it, and is refused if they differ. `name` is what messages and
  /// the ledger call the batch; empty: the name of the kind.
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

  /// Adds any potential over the same particles.
  Potential& add(std::unique_ptr<Potential> potential);

  const std::vector<std::unique_ptr<Potential>>& potentials() const { return potentials_; }

  /// The first batch of this kind, or null.
  template <ElementKind Kind>
  Batch<Kind>* find() {
    for (const auto& potential : potentials_) {
      if (auto* batch = dynamic_cast<Batch<Kind>*>(potential.get())) return batch;
      if (auto* field = dynamic_cast<PotentialField*>(potential.get()))
        if (auto* batch = field->find<Kind>()) return batch;
    }
    return nullptr;
  }
  template <ElementKind Kind>
  const Batch<Kind>* find() const {
    return const_cast<PotentialField*>(this)->find<Kind>();
  }

  /// The first batch of this name, or null.
  ElementBatch* find(std::string_view name);
  const ElementBatch* find(std::string_view name) const { return const_cast<PotentialField*>(this)->find(name); }

  std::string_view name() const override { return "field"; }
  std::size_t num_elements() const override;
  Real energy(const Positions& x) const override;
  Real add_forces(const Positions& x, Forces f) const override;
  void add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const override;
  void add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const override;
  void append_pattern(std::vector<std::pair<int, int>>& pattern) const override;
  void append_rank_one_terms(const Positions& x, StiffnessModel model, std::vector<RankOneTerm>& terms) const override;
  void add_damping(const Positions& x, Real time, BlockMatrix& damping) const override;
  void append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const override;
  Real choose_phase(const Positions& x) override;
  void add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                             Forces df) const override;
  void add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const override;
  void add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const override;
  void dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                 Forces v) const override;
  bool damps() const override;
  bool evolves() const override;
  Real evolve(const Positions& x, Real duration) override;
  void save_state() override;
  void restore_state() override;
  std::uint64_t stiffness_version() const override;
  void append_strains(const Positions& x, std::vector<Real>& strains) const override;
  void append_energies(const Positions& x, std::vector<Real>& energies) const override;
  void add_particle_energies(const Positions& x, std::span<Real> energies) const override;
  void append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const override;

 private:
  template <ElementKind Kind, class AtRest>
  Batch<Kind>& add_elements(std::span<const StencilOf<Kind>> stencils, const std::vector<Real>& stiffnesses,
                            std::string name, const AtRest& at_rest);

  PackedVectors rest_;
  std::vector<std::unique_ptr<Potential>> potentials_;
};

/// Springs on the edges and volume penalties on the tetrahedra, one stiffness in joules for every element: the seed's own
/// form. `vertices` is 3 x V [m]. Stiffness then grows as the mesh is refined; see the overload with a material.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness);

/// Elements of `model` with stiffnesses that stand for a material (see `Material`), whatever the mesh. At its least Poisson
/// ratio the volume term of a model of springs vanishes and is left out.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model = ElasticModel::springs_volumes);

template <ElementKind Kind, class AtRest>
Batch<Kind>& PotentialField::add_elements(std::span<const StencilOf<Kind>> stencils,
                                          const std::vector<Real>& stiffnesses, std::string name,
                                          const AtRest& at_rest) {
  if (name.empty()) name = Kind::name;
  if (stiffnesses.size() != stencils.size())
    throw std::invalid_argument(name + ": " + std::to_string(stiffnesses.size()) + " stiffnesses for " +
                                std::to_string(stencils.size()) + " stencils");
  auto batch = std::make_unique<Batch<Kind>>(num_particles(), name);
  batch->reserve(stencils.size());
  for (std::size_t e = 0; e < stencils.size(); ++e) {
    const std::string label = name + " " + std::to_string(e);
    try {
      batch->check(stencils[e], stiffnesses[e]);
      Points<Kind::num_points> points(3, static_cast<Eigen::Index>(stencils[e].size()));
      gather_points(stencils[e], rest_.data(), points);
      const Kind kind = at_rest(points);
      if constexpr (Constraint<Kind> && !is_own_kind<Kind>) check_gradient(kind, points, label);
      batch->add(stencils[e], kind, stiffnesses[e]);
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      throw std::invalid_argument(what.starts_with(label + ":") ? what : label + ": " + what);
    }
  }
  Batch<Kind>& added = *batch;
  potentials_.push_back(std::move(batch));
  return added;
}

}  // namespace penalty
