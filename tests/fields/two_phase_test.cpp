#include "penalty/fields/two_phase.h"

#include "fields/meshes.h"

namespace penalty::testing {
namespace {

const Material rubber{.young = 1e5, .poisson = 0.45};

struct Cube {
  TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  PotentialField field = make_recovering_field(mesh.vertices, mesh.tetrahedra, rubber);
  TwoPhase& phases = dynamic_cast<TwoPhase&>(*field.potentials()[0]);

  PackedVectors stretched(Real x, Real y = 1) const {
    PackedVectors positions = field.rest_positions();
    positions.row(0) *= x;
    positions.row(1) *= y;
    return positions;
  }
};

TEST(TwoPhase, IsTheStiffMaterialNearRest) {
  Cube cube;
  const PotentialField stiff =
      make_elastic_field(cube.mesh.vertices, cube.mesh.tetrahedra, rubber, ElasticModel::neo_hookean);
  Random random(1);
  const PackedVectors x = deformed(cube.field.rest_positions(), 0.01, random);
  EXPECT_EQ(cube.field.choose_phase(x), 0);
  EXPECT_FALSE(cube.phases.is_soft());
  EXPECT_EQ(cube.field.energy(x), stiff.energy(x));
}

TEST(TwoPhase, KeepsTheShearModulusWhereItIsSoft) {
  Cube cube;
  cube.field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(cube.phases.is_soft());
  PackedVectors sheared = cube.field.rest_positions();
  sheared.row(0) += 1e-4 * cube.field.rest_positions().row(1);
  // Simple shear g of 1 m³: mu g² / 2.
  EXPECT_NEAR(cube.field.energy(sheared), rubber.lame_mu() * 1e-8 / 2, 1e-6 * rubber.lame_mu() * 1e-8);
  // A pure dilation by s per axis: with nu = 0 the bulk modulus is 2/3 mu.
  const PackedVectors swollen = (1 + 1e-5) * cube.field.rest_positions();
  EXPECT_NEAR(cube.field.energy(swollen), rubber.lame_mu() / 3 * 9e-10, 1e-4 * rubber.lame_mu() * 3e-10);
}

TEST(TwoPhase, ChangesWithHysteresis) {
  Cube cube;
  const auto is_soft_at = [&](Real stretch) {
    cube.field.choose_phase(cube.stretched(stretch));
    return cube.phases.is_soft();
  };
  EXPECT_FALSE(is_soft_at(1.85));
  EXPECT_TRUE(is_soft_at(1.95));
  EXPECT_TRUE(is_soft_at(1.35));
  EXPECT_FALSE(is_soft_at(1.25));
  EXPECT_FALSE(is_soft_at(0.15));
  EXPECT_TRUE(is_soft_at(0.05));
  EXPECT_TRUE(is_soft_at(0.65));
  EXPECT_FALSE(is_soft_at(0.75));
  EXPECT_TRUE(is_soft_at(-1)) << "mirrored: no length differs, and yet";
  EXPECT_NEAR(cube.phases.largest_strain(cube.stretched(-1)), 2, 1e-12);
  EXPECT_NEAR(cube.phases.largest_strain(cube.stretched(1.2, 0.7)), 0.3, 1e-12);
}

TEST(TwoPhase, SaysWhatTheChangeAddsToTheEnergy) {
  Cube cube;
  const PackedVectors x = cube.stretched(2.2, 2);
  const Real before = cube.field.energy(x);
  const Real added = cube.field.choose_phase(x);
  EXPECT_LT(added, 0);
  EXPECT_DOUBLE_EQ(cube.field.energy(x), before + added);
  EXPECT_EQ(cube.field.choose_phase(x), 0) << "it is soft already";
}

TEST(TwoPhase, GoesBackToTheStateThatWasSaved) {
  Cube cube;
  cube.field.save_state();
  cube.field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(cube.phases.is_soft());
  cube.field.restore_state();
  EXPECT_FALSE(cube.phases.is_soft());
}

TEST(TwoPhase, IsJudgedByItsStiffPhaseWhicheverActs) {
  Cube cube;
  const PackedVectors& rest = cube.field.rest_positions();
  std::vector<Real> stiff(27, 0), soft(27, 0);
  cube.field.add_stiffness_bounds(rest, stiff);
  cube.field.choose_phase(cube.stretched(3));
  cube.field.add_stiffness_bounds(rest, soft);
  EXPECT_EQ(stiff, soft);
  EXPECT_GT(assembled(cube.field, rest, StiffnessModel::taut).to_dense().norm(),
            1.5 * assembled(cube.field, rest, StiffnessModel::exact).to_dense().norm());
}

TEST(TwoPhase, ListsBothPhasesAndCountsTheOneThatActs) {
  Cube cube;
  for (const Real stretch : {1.0, 3.0}) {
    const PackedVectors x = cube.stretched(1.05);
    cube.field.choose_phase(cube.stretched(stretch));
    std::vector<Real> energies, strains;
    std::vector<LedgerEntry> ledger;
    cube.field.append_energies(x, energies);
    cube.field.append_strains(x, strains);
    cube.field.append_ledger(x, ledger);
    ASSERT_EQ(energies.size(), cube.field.num_elements());
    ASSERT_EQ(strains.size(), cube.field.num_elements());
    ASSERT_EQ(ledger.size(), 2u);
    const std::size_t acts = cube.phases.is_soft() ? 0 : 1;
    EXPECT_EQ(ledger[acts].num_enabled, 40u);
    EXPECT_EQ(ledger[1 - acts].num_enabled, 0u);
    EXPECT_EQ(ledger[1 - acts].energy, 0);
    Real sum = 0;
    for (const Real energy : energies) sum += energy;
    EXPECT_NEAR(sum, cube.field.energy(x), 1e-12 * sum);
    EXPECT_NEAR(ledger[acts].energy, sum, 1e-12 * sum);
  }
}

TEST(TwoPhase, RefusesWhatDoesNotFitTogether) {
  const TetMesh one = make_box({1, 1, 1}, {1, 1, 1}), two = make_box({1, 1, 1}, {2, 1, 1});
  const auto field_of = [](const TetMesh& mesh) { return make_elastic_field(mesh.vertices, mesh.tetrahedra, rubber); };
  const auto complaint_of = [&](const TetMesh& soft, const PhaseThresholds& thresholds) {
    return complaint<std::invalid_argument>(
        [&] { TwoPhase(one.tetrahedra, field_of(soft), field_of(one), thresholds); });
  };
  EXPECT_EQ(complaint_of(two, {}), "two phases: the soft field has 12 particles, the stiff one 8");
  EXPECT_EQ(complaint_of(one, {.enter = 0.2}),
            "two phases: thresholds are 0.2 to enter and 0.3 to leave, must be 0 < leave <= enter");
  EXPECT_EQ(complaint<std::invalid_argument>([&] {
              TwoPhase(two.tetrahedra, field_of(one), field_of(one));
            }).rfind("two phases: tetrahedron ", 0),
            0u);
  const std::vector<Tetrahedron> flat{{0, 1, 2, 1}};
  EXPECT_EQ(complaint<std::invalid_argument>([&] { TwoPhase(flat, field_of(one), field_of(one)); }),
            "two phases: tetrahedron 0 has no volume at rest");
}

}  // namespace
}  // namespace penalty::testing
