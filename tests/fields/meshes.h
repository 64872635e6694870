// Small meshes and deformed states of them.
#pragma once
#include <vector>

#include "math/random.h"
#include "penalty/fields/potential_field.h"
#include "penalty/mesh/builders.h"

namespace penalty::testing {

/// A box mesh with every vertex moved at random by up to `noise` of a cell: no two elements are alike.
TetMesh noisy_box(const std::array<int, 3>& cells, Real cell_size, Real noise, Random& random);

/// The rest positions stretched and sheared, with noise of `noise` metres, turned and moved.
PackedVectors deformed(const PackedVectors& rest, Real noise, Random& random);

PackedVectors random_packed(Eigen::Index particles, Real size, Random& random);

std::vector<Real> random_inverse_masses(Eigen::Index particles, Random& random);

/// K assembled from the blocks of the elements.
BlockMatrix assembled(const Potential& potential, const PackedVectors& x, StiffnessModel model);

/// The largest eigenvalue of M^-1 K, from all of them.
Real true_largest_eigenvalue(const Potential& potential, const PackedVectors& x,
                             const std::vector<Real>& inverse_masses);

}  // namespace penalty::testing
