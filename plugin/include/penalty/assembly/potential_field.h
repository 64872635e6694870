// The potential of a body: a rest shape and the batches that remember it.
#pragma once
#include <memory>
#include <optional>

#include "penalty/assembly/batch.h"
#include "penalty/assembly/topology.h"
#include "penalty/energy/material.h"

namespace penalty {

/// A sum of potentials over the particles of one rest shape. Rest values are taken from that shape, in double, when an
/// element is added, and never change behind the caller's back.
class PotentialField final : public Potential {
 public:
  /// `rest_positions` is 3 x P [m]. Throws std::invalid_argument, naming particle and value, if one is not finite.
  explicit PotentialField(const Eigen::Matrix3Xd& rest_positions);

  int num_particles() const { return static_cast<int>(rest_.cols()); }
  const PackedVectors& rest_positions() const { return rest_; }

  /// Adds one element a stencil, at rest in the rest shape, all of stiffness `stiffness` [J]. Errors are those of
  /// `Batch::add` and `Kind::at_rest`. The batch stays owned by the field.
  template <Constraint Kind>
  Batch<Kind>& add(std::span<const std::array<int, Kind::num_points>> stencils, Real stiffness) {
    return add<Kind>(stencils, std::vector<Real>(stencils.size(), stiffness));
  }

  /// The same with a stiffness of its own for each stencil.
  template <Constraint Kind>
  Batch<Kind>& add(std::span<const std::array<int, Kind::num_points>> stencils, const std::vector<Real>& stiffnesses);

  /// Adds any potential over the same particles.
  Potential& add(std::unique_ptr<Potential> potential);

  const std::vector<std::unique_ptr<Potential>>& potentials() const { return potentials_; }

  /// The first batch of this kind, or null.
  template <Constraint Kind>
  const Batch<Kind>* find() const {
    for (const auto& potential : potentials_)
      if (const auto* batch = dynamic_cast<const Batch<Kind>*>(potential.get())) return batch;
    return nullptr;
  }

  std::string_view name() const override { return "field"; }
  std::size_t num_elements() const override;
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
  PackedVectors rest_;
  std::vector<std::unique_ptr<Potential>> potentials_;
};

/// Springs on the edges and volume penalties on the tetrahedra, one stiffness in joules for every element: the seed's own
/// form. `vertices` is 3 x V [m]. Stiffness then grows as the mesh is refined; see the overload with a material.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  Real stiffness);

/// The same elements with stiffnesses that stand for a material (see `Material`), whatever the mesh. At Poisson ratio 1/4
/// the volume term vanishes and only the springs are added.
PotentialField make_elastic_field(const Eigen::Matrix3Xd& vertices, std::span<const Tetrahedron> tetrahedra,
                                  const Material& material);

template <Constraint Kind>
Batch<Kind>& PotentialField::add(std::span<const std::array<int, Kind::num_points>> stencils,
                                 const std::vector<Real>& stiffnesses) {
  if (stiffnesses.size() != stencils.size())
    throw std::invalid_argument(std::string(Kind::name) + ": " + std::to_string(stiffnesses.size()) +
                                " stiffnesses for " + std::to_string(stencils.size()) + " stencils");
  auto batch = std::make_unique<Batch<Kind>>(num_particles());
  batch->reserve(stencils.size());
  for (std::size_t e = 0; e < stencils.size(); ++e) {
    Points<Kind::num_points> points;
    try {
      batch->check(stencils[e], stiffnesses[e]);
      for (int k = 0; k < Kind::num_points; ++k) points.col(k) = rest_.col(stencils[e][k]).template head<3>();
      batch->add(stencils[e], Kind::at_rest(points), stiffnesses[e]);
    } catch (const std::invalid_argument& error) {
      const std::string prefix = std::string(Kind::name) + " " + std::to_string(e) + ": ";
      const std::string what = error.what();
      throw std::invalid_argument(what.starts_with(prefix) ? what : prefix + what);
    }
  }
  Batch<Kind>& added = *batch;
  potentials_.push_back(std::move(batch));
  return added;
}

}  // namespace penalty
