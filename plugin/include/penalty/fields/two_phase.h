// A potential that gives way while it is far from its rest shape.
#pragma once
#include <array>

#include "penalty/fields/potential_field.h"

namespace penalty {

/// When a body counts as far from its rest shape: when the strain of some tetrahedron, max_k |s_k - 1| over its signed
/// principal stretches s_k, exceeds `enter`; and again as near when all have fallen below `leave`. An inverted tetrahedron
/// has a negative stretch, hence a strain above 1.
struct PhaseThresholds {
  Real enter = 0.9, leave = 0.3;
};

/// Two potentials over the same tetrahedra: a soft one, which acts while the body is far from its rest shape, and a stiff one,
/// which acts near it. A material that resists changes of volume much more than changes of shape has rest states that
/// are no rest shape, wound-up and folded ones, from which no force leads back; a soft one without that resistance has
/// none that has ever been met. The energy jumps when the phase changes: solvers book that as a change from outside.
class TwoPhase final : public Potential {
 public:
  /// Both fields are of the same rest shape. Starts stiff. Throws std::invalid_argument for fields of another number of particles
  /// and for thresholds that are not 0 < leave <= enter.
  TwoPhase(std::span<const Tetrahedron> tetrahedra, PotentialField soft, PotentialField stiff,
           const PhaseThresholds& thresholds = {});

  bool is_soft() const { return soft_active_; }
  PotentialField& soft() { return fields_[0]; }
  PotentialField& stiff() { return fields_[1]; }

  /// Largest strain of a tetrahedron, as in PhaseThresholds.
  Real largest_strain(const Positions& x) const;

  Real choose_phase(const Positions& x) override;

  std::string_view name() const override { return "two phases"; }
  std::size_t num_elements() const override;
  Real energy(const Positions& x) const override { return active().energy(x); }
  Real add_forces(const Positions& x, Forces f) const override { return active().add_forces(x, f); }
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
  bool damps() const override { return active().damps(); }
  bool evolves() const override { return active().evolves(); }
  Real evolve(const Positions& x, Real duration) override { return active().evolve(x, duration); }
  void save_state() override;
  void restore_state() override;
  std::uint64_t stiffness_version() const override;

  // Of both phases, the soft one first; of the one that does not act zeros, and no element enabled.
  void append_strains(const Positions& x, std::vector<Real>& strains) const override;
  void append_energies(const Positions& x, std::vector<Real>& energies) const override;
  void add_particle_energies(const Positions& x, std::span<Real> energies) const override;
  void append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const override;

 private:
  const PotentialField& active() const { return fields_[soft_active_ ? 0 : 1]; }
  PotentialField& active() { return fields_[soft_active_ ? 0 : 1]; }
  // What the stable step is judged by must hold in both phases.
  const PotentialField& for_model(StiffnessModel model) const {
    return model == StiffnessModel::taut ? fields_[1] : active();
  }
  bool exceeds(const Positions& x, Real limit) const;
  Matrix3 deformation_gradient(std::size_t t, const Positions& x) const;

  std::vector<Tetrahedron> tetrahedra_;
  std::vector<Matrix3> inverse_rest_;  // (edges from the first point)⁻¹ at rest [1/m]
  std::array<PotentialField, 2> fields_;
  PhaseThresholds thresholds_;
  bool soft_active_ = false, saved_soft_ = false;
};

/// `make_elastic_field` of the same arguments, but while the body is far from its rest shape it is of the neo-Hookean material with
/// the same shear modulus and no resistance to changes of volume beyond that. One TwoPhase potential: finds back from any
/// start, whatever the material.
PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model = ElasticModel::neo_hookean,
                                     const PhaseThresholds& thresholds = {});

}  // namespace penalty
