// Small meshes and deformed states of them.
#pragma once
#include <vector>

#include "math/random.h"
#include "penalty/fields/elastic_field.h"
#include "penalty/fields/ledger.h"
#include "penalty/mesh/builders.h"

namespace penalty::testing {

/// A box mesh with every vertex moved at random by up to `noise` of a cell: no two elements are alike.
TetMesh noisy_box(const std::array<int, 3>& cells, Real cell_size, Real noise, Random& random);

/// The rest positions stretched and sheared, with noise of `noise` metres, turned and moved.
PackedVectors deformed(const PackedVectors& rest, Real noise, Random& random);

PackedVectors random_packed(Eigen::Index particles, Real size, Random& random);

std::vector<Real> random_inverse_masses(Eigen::Index particles, Random& random);

/// K of a field or of one of its potentials, assembled.
template <class Elements>
System assembled(const Elements& elements, const PackedVectors& x, StiffnessModel model) {
  const auto walk = [&](System& system) { elements.add_stiffness(x, model, system); };
  System k = System::with_pattern(static_cast<int>(x.cols()), walk);
  walk(k);
  return k;
}

/// -D v, D the damping matrix of a field or of one of its potentials.
template <class Elements>
PackedVectors damping_forces(const Elements& elements, const PackedVectors& x, const PackedVectors& v, Real time) {
  const auto walk = [&](System& system) { elements.add_damping(x, time, system); };
  System d = System::with_pattern(static_cast<int>(x.cols()), walk);
  walk(d);
  PackedVectors f = PackedVectors::Zero(4, x.cols());
  d.add_product(v, -1, f);
  return f;
}

/// The largest eigenvalue of M^-1 K, from all of them.
Real true_largest_eigenvalue(const PotentialField& field, const PackedVectors& x,
                             const std::vector<Real>& inverse_masses);

}  // namespace penalty::testing
