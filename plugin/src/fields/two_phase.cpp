#include "penalty/fields/two_phase.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "penalty/math/isotropic_projection.h"

namespace penalty {
namespace {

Matrix3 edges_from_first(const Tetrahedron& t, const Positions& x) {
  Matrix3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = (x.col(t[k + 1]) - x.col(t[0])).head<3>();
  return edges;
}

}  // namespace

TwoPhase::TwoPhase(std::span<const Tetrahedron> tetrahedra, PotentialField soft, PotentialField stiff,
                   const PhaseThresholds& thresholds)
    : tetrahedra_(tetrahedra.begin(), tetrahedra.end()),
      fields_{std::move(soft), std::move(stiff)},
      thresholds_(thresholds) {
  if (fields_[0].num_particles() != fields_[1].num_particles())
    throw std::invalid_argument("two phases: the soft field has " + std::to_string(fields_[0].num_particles()) +
                                " particles, the stiff one " + std::to_string(fields_[1].num_particles()));
  if (!(thresholds.leave > 0 && thresholds.leave <= thresholds.enter && std::isfinite(thresholds.enter)))
    throw std::invalid_argument("two phases: thresholds are " + to_text(thresholds.enter) + " to enter and " +
                                to_text(thresholds.leave) + " to leave, must be 0 < leave <= enter");
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    for (const int i : tetrahedra_[t])
      if (i < 0 || i >= fields_[0].num_particles())
        throw std::invalid_argument("two phases: tetrahedron " + std::to_string(t) + ": index " + std::to_string(i) +
                                    " is outside the " + std::to_string(fields_[0].num_particles()) + " particles");
    inverse_rest_.push_back(edges_from_first(tetrahedra_[t], fields_[1].rest_positions()).inverse());
    if (!inverse_rest_.back().allFinite())
      throw std::invalid_argument("two phases: tetrahedron " + std::to_string(t) + " has no volume at rest");
  }
}

Matrix3 TwoPhase::deformation_gradient(std::size_t t, const Positions& x) const {
  return edges_from_first(tetrahedra_[t], x) * inverse_rest_[t];
}

Real TwoPhase::largest_strain(const Positions& x) const {
  Real largest = 0;
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t)
    largest = std::max(largest, (signed_singular_values(deformation_gradient(t, x)).array() - 1).abs().maxCoeff());
  return largest;
}

bool TwoPhase::exceeds(const Positions& x, Real limit) const {
  for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
    const Matrix3 f = deformation_gradient(t, x);
    // |s² - 1| <= |FᵀF - 1|, and |s - 1| <= |s² - 1| for s >= 0: most elements need no more.
    if (f.determinant() > 0 && (f.transpose() * f - Matrix3::Identity()).norm() <= limit) continue;
    if ((signed_singular_values(f).array() - 1).abs().maxCoeff() > limit) return true;
  }
  return false;
}

Real TwoPhase::choose_phase(const Positions& x) {
  const bool soft = exceeds(x, soft_active_ ? thresholds_.leave : thresholds_.enter);
  if (soft == soft_active_) return 0;
  const Real before = active().energy(x);
  soft_active_ = soft;
  return active().energy(x) - before;
}

std::size_t TwoPhase::num_elements() const { return fields_[0].num_elements() + fields_[1].num_elements(); }

void TwoPhase::add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const {
  active().add_damping_forces(x, v, time, f);
}
void TwoPhase::add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const {
  for_model(model).add_stiffness(x, model, stiffness);
}
void TwoPhase::append_pattern(std::vector<std::pair<int, int>>& pattern) const {
  for (const PotentialField& field : fields_) field.append_pattern(pattern);
}
void TwoPhase::append_rank_one_terms(const Positions& x, StiffnessModel model, std::vector<RankOneTerm>& terms) const {
  for_model(model).append_rank_one_terms(x, model, terms);
}
void TwoPhase::add_damping(const Positions& x, Real time, BlockMatrix& damping) const {
  active().add_damping(x, time, damping);
}
void TwoPhase::append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const {
  active().append_damping_terms(x, time, terms);
}
void TwoPhase::add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                     Forces df) const {
  for_model(model).add_stiffness_product(x, model, dx, scale, df);
}
void TwoPhase::add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const {
  active().add_stiffness_diagonal(x, scale, diagonal);
}
void TwoPhase::add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const {
  for_model(StiffnessModel::taut).add_stiffness_bounds(x, bounds);
}
void TwoPhase::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                         Forces v) const {
  active().dissipate(x, inverse_masses, time, duration, v);
}

void TwoPhase::save_state() {
  for (PotentialField& field : fields_) field.save_state();
  saved_soft_ = soft_active_;
}

void TwoPhase::restore_state() {
  for (PotentialField& field : fields_) field.restore_state();
  soft_active_ = saved_soft_;
}

std::uint64_t TwoPhase::stiffness_version() const {
  return fields_[0].stiffness_version() + fields_[1].stiffness_version();
}

void TwoPhase::append_strains(const Positions& x, std::vector<Real>& strains) const {
  if (!soft_active_) strains.resize(strains.size() + fields_[0].num_elements(), 0);
  active().append_strains(x, strains);
  if (soft_active_) strains.resize(strains.size() + fields_[1].num_elements(), 0);
}

void TwoPhase::append_energies(const Positions& x, std::vector<Real>& energies) const {
  if (!soft_active_) energies.resize(energies.size() + fields_[0].num_elements(), 0);
  active().append_energies(x, energies);
  if (soft_active_) energies.resize(energies.size() + fields_[1].num_elements(), 0);
}

void TwoPhase::add_particle_energies(const Positions& x, std::span<Real> energies) const {
  active().add_particle_energies(x, energies);
}

void TwoPhase::append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const {
  for (const PotentialField& field : fields_) {
    const std::size_t first = ledger.size();
    field.append_ledger(x, ledger);
    if (&field == &active()) continue;
    for (std::size_t k = first; k < ledger.size(); ++k)
      ledger[k] = {.name = ledger[k].name, .num_elements = ledger[k].num_elements};
  }
}

PotentialField make_recovering_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                     const Material& material, ElasticModel model, const PhaseThresholds& thresholds) {
  material.check(model);
  // mu = E / 2 (1 + nu) stays; without lambda nu is 0.
  Material soft = material;
  soft.young = 2 * material.lame_mu();
  soft.poisson = 0;
  PotentialField field(vertices);
  field.add(std::make_unique<TwoPhase>(tetrahedra,
                                       make_elastic_field(vertices, tetrahedra, soft, ElasticModel::neo_hookean),
                                       make_elastic_field(vertices, tetrahedra, material, model), thresholds));
  return field;
}

}  // namespace penalty
