#include "penalty/assembly/potential_field.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace penalty {

PotentialField::PotentialField(const Eigen::Matrix3Xd& rest_positions) : rest_(pack(rest_positions)) {
  for (Eigen::Index i = 0; i < rest_positions.cols(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (!std::isfinite(rest_positions(axis, i)))
        throw std::invalid_argument("field: rest position " + std::to_string(i) + ": coordinate " + "xyz"[axis] + " is " +
                                    to_text(rest_positions(axis, i)));
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

void PotentialField::append_values(const Positions& x, std::vector<Real>& values) const {
  for (const auto& potential : potentials_) potential->append_values(x, values);
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness) {
  PotentialField field(vertices);
  field.add<Length>(edges_of(tetrahedra), stiffness);
  field.add<TetrahedronVolume>(tetrahedra, stiffness);
  return field;
}

PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material) {
  material.check();
  PotentialField field(vertices);
  const std::vector<Edge> edges = edges_of(tetrahedra);
  std::vector<Real> volumes = signed_volumes(vertices, tetrahedra);
  for (Real& volume : volumes) volume = std::abs(volume);
  std::vector<Real> stiffnesses = edge_volume_shares(edges, tetrahedra, volumes);
  for (Real& k : stiffnesses) k *= material.length_stiffness_density();
  field.add<Length>(edges, stiffnesses);
  // Poisson ratio 1/4 computed in floating point may leave a volume term of either sign in the last digits.
  const Real density = material.volume_stiffness_density();
  if (density > 1e-12 * material.young) {
    for (Real& volume : volumes) volume *= density;
    field.add<TetrahedronVolume>(tetrahedra, volumes);
  }
  return field;
}

}  // namespace penalty
