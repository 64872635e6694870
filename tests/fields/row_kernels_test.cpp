// What batches compute four elements at a time, for processors that can, is what the loop over single elements does.
#include "fields/meshes.h"
#include "penalty/fields/batch_loops.h"

namespace penalty::testing {
namespace {

template <class Kind>
std::vector<StencilOf<Kind>> stencils_in(const TetMesh& mesh) {
  if constexpr (Kind::num_points == 2)
    return edges_of(mesh.tetrahedra);
  else if constexpr (Kind::num_points == 3)
    return faces_of(mesh.tetrahedra);
  else
    return mesh.tetrahedra;
}

struct PlacedPoints {
  const char* name;
  PackedVectors x;
};

// Where elements are turned, inverted, flat, in a line or in one place, all of them or one in four.
std::vector<PlacedPoints> states(const PackedVectors& rest, Random& random) {
  const PackedVectors turned = deformed(rest, 0.05, random);
  PackedVectors inverted = turned, flat = rest + random_packed(rest.cols(), 0.05, random), line, point, mixed;
  inverted.row(1) *= -1;
  flat.row(2).setConstant(3);
  line = flat;
  line.row(1).setConstant(2);
  point = line;
  point.row(0).setConstant(1);
  mixed = turned;
  for (Eigen::Index i = 0; i < mixed.cols() / 4; ++i) mixed.col(i) = mixed.col(0);
  return {{"turned", turned},
          {"inverted", inverted},
          {"flat", flat},
          {"in a line", line},
          {"in one place", point},
          {"partly in one place", mixed},
          {"anywhere", random_packed(rest.cols(), 1, random)}};
}

template <class Kind>
class RowKernelOf : public ::testing::Test {};
using RowKinds = ::testing::Types<Length, TriangleArea, TetrahedronVolume, StableNeoHookean>;
TYPED_TEST_SUITE(RowKernelOf, RowKinds);

TYPED_TEST(RowKernelOf, ComputesWhatTheReferenceDoes) {
  Random random(1);
  const TetMesh mesh = noisy_box({3, 3, 3}, 1, 0.2, random);
  const PackedVectors rest = pack(mesh.vertices);
  const auto stencils = stencils_in<TypeParam>(mesh);
  ASSERT_GT(stencils.size(), 130);
  for (const std::size_t size : {std::size_t(1), std::size_t(3), std::size_t(4), std::size_t(7), std::size_t(64),
                                 std::size_t(71), stencils.size()}) {
    const auto batch = make_batch<TypeParam>(static_cast<int>(rest.cols()));
    for (std::size_t e = 0; e < size; ++e) {
      Points<TypeParam::num_points> points;
      gather_points(stencils[e], rest.data(), points);
      batch->add(stencils[e], example_of<TypeParam>(1).at_rest(points), std::pow(10.0, random.uniform(-1, 1)));
    }
    for (const auto& [name, x] : states(rest, random)) {
      PackedVectors expected = PackedVectors::Zero(4, x.cols()), f = expected, only = expected;
      const Real expected_energy = add_element_forces(batch->stencils().data(), batch->kinds().data(),
                                                      batch->stiffnesses().data(), size, x.data(), expected.data());
      const Real energy = batch->add_forces(x, f), largest = expected.colwise().norm().maxCoeff();
      batch->add_forces_only(x, only);
      EXPECT_LE((f - expected).colwise().norm().maxCoeff(), 1e-14 * largest) << name << ", " << size << " elements";
      EXPECT_LE((only - expected).colwise().norm().maxCoeff(), 1e-14 * largest) << name << ", " << size << " elements";
      EXPECT_LE(std::abs(energy - expected_energy), 1e-14 * expected_energy) << name << ", " << size << " elements";
      EXPECT_TRUE(f.row(3).isZero(0));
    }
  }
}

TYPED_TEST(RowKernelOf, DoesNotReadWhatPadsParticles) {
  Random random(2);
  const TetMesh mesh = noisy_box({3, 3, 3}, 1, 0.2, random);
  const auto stencils = stencils_in<TypeParam>(mesh);
  PackedVectors x = pack(mesh.vertices);
  const auto batch = make_batch<TypeParam>(static_cast<int>(x.cols()));
  for (const auto& stencil : stencils) {
    Points<TypeParam::num_points> points;
    gather_points(stencil, x.data(), points);
    batch->add(stencil, example_of<TypeParam>(1).at_rest(points), 1);
  }
  x = deformed(x, 0.05, random);
  PackedVectors expected = PackedVectors::Zero(4, x.cols()), f = expected;
  const Real energy = batch->add_forces(x, expected);
  x.row(3).setRandom();
  EXPECT_EQ(batch->add_forces(x, f), energy);
  EXPECT_EQ(f.topRows<3>(), expected.topRows<3>());
}

}  // namespace
}  // namespace penalty::testing
