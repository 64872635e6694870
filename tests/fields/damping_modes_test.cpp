// The damping matrix as a sum of modes is the damping matrix.
#include "penalty/fields/damping_modes.h"

#include <numeric>

#include "fields/meshes.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty::testing {
namespace {

// Modes of two particles, alone and shared between elements and batches, of three, of four, of many, and one that something
// outside holds.
PotentialField every_size_of_mode(Random& random) {
  const TetMesh mesh = noisy_box({2, 2, 2}, 1, 0.2, random);
  PotentialField field(mesh.vertices);
  field.add<Length>(edges_of(mesh.tetrahedra), 3);
  field.add(StableNeoHookean::with_ratio(3), mesh.tetrahedra, std::vector<Real>(mesh.tetrahedra.size(), 2));
  field.add<TriangleArea>(faces_of(mesh.tetrahedra), 5);
  field.add<TetrahedronVolume>(mesh.tetrahedra, 7);
  std::vector<int> all(mesh.vertices.cols());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Triangle> hull = boundary_faces(mesh.tetrahedra);
  field.add(EnclosedVolume({hull.begin(), hull.end()}), std::span(&all, 1), 1);
  const StencilOf<Distance> corner{0};
  field.add(Distance::to(Vector3(-1, -2, -3)), std::span(&corner, 1), 4);
  return field;
}

DampingModes modes_of(const PotentialField& field, const PackedVectors& x, Real time, Real duration) {
  const auto walk = [&](DampingModes& modes) {
    modes.begin();
    for (const auto& potential : field.potentials()) potential->add_damping_modes(x, time, duration, modes);
    modes.end();
  };
  DampingModes modes = DampingModes::with_pattern(walk);
  walk(modes);
  return modes;
}

TEST(DampingModes, SumToTheDampingMatrix) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Random random(seed);
    PotentialField field = every_size_of_mode(random);
    ElementBatch& springs = field.batch("length");
    springs.set_damping_time(3, 0.7);
    springs.set_enabled(5, false);
    springs.set_free_play(7, -infinite, 0);
    const PackedVectors x = deformed(field.rest_positions(), 0.1, random), v = random_packed(x.cols(), 1, random);
    PackedVectors product = PackedVectors::Zero(4, x.cols());
    modes_of(field, x, 0.1, 0.5).add_product(v, product);
    ASSERT_LT(relative_error(-product, 0.5 * damping_forces(field, x, v, 0.1)), 1e-13) << "seed " << seed;
  }
}

TEST(DampingModes, HaveNoValuesLeftOfAnEarlierWalk) {
  Random random(1);
  const PotentialField field = every_size_of_mode(random);
  const PackedVectors x = deformed(field.rest_positions(), 0.1, random), v = random_packed(x.cols(), 1, random);
  DampingModes modes = modes_of(field, field.rest_positions(), 3, 2);
  modes.begin();
  for (const auto& potential : field.potentials()) potential->add_damping_modes(x, 0.1, 1, modes);
  modes.end();
  PackedVectors product = PackedVectors::Zero(4, x.cols());
  modes.add_product(v, product);
  EXPECT_LT(relative_error(-product, damping_forces(field, x, v, 0.1)), 1e-13);
}

TEST(DampingModes, HaveBoundsAboveTheirRowSums) {
  Random random(2);
  const PotentialField field = every_size_of_mode(random);
  const PackedVectors x = deformed(field.rest_positions(), 0.1, random);
  const DampingModes modes = modes_of(field, x, 0.1, 1);
  std::vector<Real> bounds(x.cols(), 0);
  modes.add_bounds(bounds);
  const Eigen::Index size = 3 * x.cols();
  Eigen::MatrixXd matrix(size, size);
  for (Eigen::Index k = 0; k < size; ++k) {
    PackedVectors unit = PackedVectors::Zero(4, x.cols()), column = unit;
    unit(k % 3, k / 3) = 1;
    modes.add_product(unit, column);
    matrix.col(k) = column.topRows<3>().reshaped();
  }
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    Real sum = 0;  // of the norms of the blocks: no eigenvalue is above the largest of these
    for (Eigen::Index j = 0; j < x.cols(); ++j) sum += matrix.block<3, 3>(3 * i, 3 * j).norm();
    EXPECT_GE(bounds[i], (1 - 1e-12) * sum) << "particle " << i;
  }
}

}  // namespace
}  // namespace penalty::testing
