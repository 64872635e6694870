#include "penalty/fields/potential_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace penalty {

PotentialField::PotentialField(const Eigen::Matrix3Xd& rest_positions) : rest_(pack(rest_positions)) {
  for (Eigen::Index i = 0; i < rest_positions.cols(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (!std::isfinite(rest_positions(axis, i)))
        throw std::invalid_argument("field: rest position " + std::to_string(i) + ": coordinate " + "xyz"[axis] +
                                    " is " + to_text(rest_positions(axis, i)));
}

Potential& PotentialField::add(std::unique_ptr<Potential> potential) {
  if (!potential) throw std::invalid_argument("field: null potential");
  potentials_.push_back(std::move(potential));
  return *potentials_.back();
}

std::size_t PotentialField::num_elements() const {
  std::size_t sum = 0;
  for (const auto& potential : potentials_) sum += potential->num_elements();
  return sum;
}

Real PotentialField::energy(const Positions& x) const {
  Real sum = 0;
  for (const auto& potential : potentials_) sum += potential->energy(x);
  return sum;
}

Real PotentialField::add_forces(const Positions& x, Forces f) const {
  Real sum = 0;
  for (const auto& potential : potentials_) sum += potential->add_forces(x, f);
  return sum;
}

void PotentialField::add_damping_forces(const Positions& x, const Vectors& v, Real time, Forces f) const {
  for (const auto& potential : potentials_) potential->add_damping_forces(x, v, time, f);
}

void PotentialField::add_stiffness(const Positions& x, StiffnessModel model, BlockMatrix& stiffness) const {
  for (const auto& potential : potentials_) potential->add_stiffness(x, model, stiffness);
}

void PotentialField::append_pattern(std::vector<std::pair<int, int>>& pattern) const {
  for (const auto& potential : potentials_) potential->append_pattern(pattern);
}

void PotentialField::append_rank_one_terms(const Positions& x, StiffnessModel model,
                                           std::vector<RankOneTerm>& terms) const {
  for (const auto& potential : potentials_) potential->append_rank_one_terms(x, model, terms);
}

void PotentialField::add_damping(const Positions& x, Real time, BlockMatrix& damping) const {
  for (const auto& potential : potentials_) potential->add_damping(x, time, damping);
}

void PotentialField::append_damping_terms(const Positions& x, Real time, std::vector<RankOneTerm>& terms) const {
  for (const auto& potential : potentials_) potential->append_damping_terms(x, time, terms);
}

Real PotentialField::choose_phase(const Positions& x) {
  Real added = 0;
  for (const auto& potential : potentials_) added += potential->choose_phase(x);
  return added;
}

void PotentialField::add_stiffness_product(const Positions& x, StiffnessModel model, const Vectors& dx, Real scale,
                                           Forces df) const {
  for (const auto& potential : potentials_) potential->add_stiffness_product(x, model, dx, scale, df);
}

void PotentialField::add_stiffness_diagonal(const Positions& x, Real scale, Forces diagonal) const {
  for (const auto& potential : potentials_) potential->add_stiffness_diagonal(x, scale, diagonal);
}

void PotentialField::add_stiffness_bounds(const Positions& x, std::span<Real> bounds) const {
  for (const auto& potential : potentials_) potential->add_stiffness_bounds(x, bounds);
}

void PotentialField::dissipate(const Positions& x, std::span<const Real> inverse_masses, Real time, Real duration,
                               Forces v) const {
  for (const auto& potential : potentials_) potential->dissipate(x, inverse_masses, time, duration, v);
}

bool PotentialField::damps() const {
  return std::any_of(potentials_.begin(), potentials_.end(), [](const auto& p) { return p->damps(); });
}

bool PotentialField::evolves() const {
  return std::any_of(potentials_.begin(), potentials_.end(), [](const auto& p) { return p->evolves(); });
}

Real PotentialField::evolve(const Positions& x, Real duration) {
  Real taken = 0;
  for (const auto& potential : potentials_) taken += potential->evolve(x, duration);
  return taken;
}

void PotentialField::save_state() {
  for (const auto& potential : potentials_) potential->save_state();
}

void PotentialField::restore_state() {
  for (const auto& potential : potentials_) potential->restore_state();
}

std::uint64_t PotentialField::stiffness_version() const {
  std::uint64_t sum = potentials_.size();
  for (const auto& potential : potentials_) sum += potential->stiffness_version();
  return sum;
}

void PotentialField::append_strains(const Positions& x, std::vector<Real>& strains) const {
  for (const auto& potential : potentials_) potential->append_strains(x, strains);
}

void PotentialField::append_energies(const Positions& x, std::vector<Real>& energies) const {
  for (const auto& potential : potentials_) potential->append_energies(x, energies);
}

void PotentialField::add_particle_energies(const Positions& x, std::span<Real> energies) const {
  for (const auto& potential : potentials_) potential->add_particle_energies(x, energies);
}

void PotentialField::append_ledger(const Positions& x, std::vector<LedgerEntry>& ledger) const {
  for (const auto& potential : potentials_) potential->append_ledger(x, ledger);
}

ElementBatch* PotentialField::find(std::string_view name) {
  for (const auto& potential : potentials_) {
    if (auto* batch = dynamic_cast<ElementBatch*>(potential.get()); batch && batch->name() == name) return batch;
    if (auto* field = dynamic_cast<PotentialField*>(potential.get()))
      if (auto* batch = field->find(name)) return batch;
  }
  return nullptr;
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness) {
  PotentialField field(vertices);
  field.add<Length>(edges_of(tetrahedra), stiffness);
  field.add<TetrahedronVolume>(tetrahedra, stiffness);
  return field;
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material, ElasticModel model) {
  material.check(model);
  PotentialField field(vertices);
  std::vector<Real> volumes = signed_volumes(vertices, tetrahedra);
  for (Real& volume : volumes) volume = std::abs(volume);
  const auto scaled = [](std::vector<Real> shares, Real density) {
    for (Real& share : shares) share *= density;
    return shares;
  };
  if (model == ElasticModel::neo_hookean) {
    field.add(StableNeoHookean::with_ratio(material.lame_lambda() / material.lame_mu()), tetrahedra,
              scaled(volumes, material.lame_mu()));
  } else {
    const std::vector<Edge> edges = edges_of(tetrahedra);
    field.add<Length>(edges,
                      scaled(edge_volume_shares(edges, tetrahedra, volumes), material.length_stiffness_density(model)));
    if (material.area_stiffness_density(model) > 0) {
      const std::vector<Triangle> faces = faces_of(tetrahedra);
      field.add<TriangleArea>(
          faces, scaled(face_volume_shares(faces, tetrahedra, volumes), material.area_stiffness_density(model)));
    }
    // The least Poisson ratio, computed in floating point, may leave a volume term of either sign in the last digits.
    const Real density = material.volume_stiffness_density(model);
    if (density > 1e-12 * material.young) field.add<TetrahedronVolume>(tetrahedra, scaled(volumes, density));
  }
  if (material.damping > 0)
    for (const auto& potential : field.potentials())
      dynamic_cast<ElementBatch&>(*potential).set_damping_time(material.damping);
  return field;
}

}  // namespace penalty
