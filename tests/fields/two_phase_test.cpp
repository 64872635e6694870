// Fields of two phases: soft far from rest, stiff near it.
#include <algorithm>
#include <functional>

#include "fields/meshes.h"

namespace penalty::testing {
namespace {

const Material rubber{.young = 1e5, .poisson = 0.45};

struct Cube {
  TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  PotentialField field = make_recovering_field(mesh.vertices, mesh.tetrahedra, rubber);

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
  EXPECT_FALSE(cube.field.is_soft());
  EXPECT_EQ(cube.field.energy(x), stiff.energy(x));
}

TEST(TwoPhase, KeepsTheShearModulusWhereItIsSoft) {
  Cube cube;
  cube.field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(cube.field.is_soft());
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
    return cube.field.is_soft();
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
  EXPECT_NEAR(cube.field.largest_strain(cube.stretched(-1)), 2, 1e-12);
  EXPECT_NEAR(cube.field.largest_strain(cube.stretched(1.2, 0.7)), 0.3, 1e-12);
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
  const FieldState near = cube.field.state();
  cube.field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(cube.field.is_soft());
  const FieldState far = cube.field.state();
  cube.field.set_state(near);
  EXPECT_FALSE(cube.field.is_soft());
  cube.field.set_state(far);
  EXPECT_TRUE(cube.field.is_soft());
}

TEST(TwoPhase, FindLooksIntoBothPhasesTheStiffOneFirst) {
  Cube cube;
  const Batch<StableNeoHookean>* found = cube.field.find<StableNeoHookean>();
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found, cube.field.potentials()[1].get());
  EXPECT_NEAR(found->kinds()[0].lambda_over_mu, rubber.lame_lambda() / rubber.lame_mu(), 1e-12);
  EXPECT_EQ(&cube.field.batch("stable neo-Hookean"), found);
  PotentialField springs =
      make_recovering_field(cube.mesh.vertices, cube.mesh.tetrahedra, rubber, ElasticModel::springs_volumes);
  springs.batch<Length>().set_target(0, 0.1);
  EXPECT_GT(springs.energy(springs.rest_positions()), 0);
}

TEST(TwoPhase, IsTakenInByAnotherFieldWithItsSwitch) {
  Cube cube, other;
  const PackedVectors x = cube.stretched(3);
  cube.field.add(std::move(other.field));
  const Real near = cube.field.energy(x);
  const Real added = cube.field.choose_phase(x);
  EXPECT_LT(added, 0);
  EXPECT_NEAR(cube.field.energy(x), near + added, 1e-12 * near);
  EXPECT_TRUE(cube.field.acts(0) && !cube.field.acts(1) && cube.field.acts(2) && !cube.field.acts(3));
}

TEST(TwoPhase, IsJudgedByItsStiffPhaseWhicheverActs) {
  Cube cube;
  const PackedVectors& rest = cube.field.rest_positions();
  const Eigen::MatrixXd near = assembled(cube.field, rest, StiffnessModel::taut).to_dense();
  cube.field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(cube.field.is_soft());
  EXPECT_EQ(assembled(cube.field, rest, StiffnessModel::taut).to_dense(), near);
  EXPECT_GT(assembled(cube.field, rest, StiffnessModel::taut).to_dense().norm(),
            1.5 * assembled(cube.field, rest, StiffnessModel::exact).to_dense().norm());
}

TEST(TwoPhase, ListsBothPhasesAndCountsTheOneThatActs) {
  Cube cube;
  for (const Real stretch : {1.0, 3.0}) {
    const PackedVectors x = cube.stretched(1.05);
    cube.field.choose_phase(cube.stretched(stretch));
    const std::vector<Real> energies = penalty::energies(cube.field, x), strains = penalty::strains(cube.field, x);
    const std::vector<LedgerEntry> ledger = penalty::ledger(cube.field, x);
    ASSERT_EQ(energies.size(), cube.field.num_elements());
    ASSERT_EQ(strains.size(), cube.field.num_elements());
    ASSERT_EQ(ledger.size(), 2u);
    const std::size_t acts = cube.field.is_soft() ? 0 : 1;
    EXPECT_EQ(ledger[acts].num_enabled, 40u);
    EXPECT_EQ(ledger[1 - acts].num_enabled, 0u);
    EXPECT_EQ(ledger[1 - acts].energy, 0);
    Real sum = 0;
    for (const Real energy : energies) sum += energy;
    EXPECT_NEAR(sum, cube.field.energy(x), 1e-12 * sum);
    EXPECT_NEAR(ledger[acts].energy, sum, 1e-12 * sum);
  }
}

// Elements of a batch that break next, where they are stretched.
template <class Kind>
void weaken(Batch<Kind>& batch, const std::function<bool(const StencilOf<Kind>&)>& which) {
  for (int e = 0; e < static_cast<int>(batch.num_elements()); ++e)
    if (which(batch.stencils()[e])) batch.set_breaking(e, {.upper = 0.1});
}

template <class Kind>
std::vector<bool> enabled(const Batch<Kind>& batch) {
  std::vector<bool> all;
  all.reserve(batch.num_elements());
  for (int e = 0; e < static_cast<int>(batch.num_elements()); ++e) all.push_back(batch.is_enabled(e));
  return all;
}

bool contains(std::span<const int> stencil, int particle) {
  return std::find(stencil.begin(), stencil.end(), particle) != stencil.end();
}

Batch<StableNeoHookean>& soft_phase(PotentialField& field) {
  return static_cast<Batch<StableNeoHookean>&>(*field.potentials()[0]);
}

TEST(TwoPhase, WhatBrokeInOnePhaseIsBrokenInTheOther) {
  Cube cube;
  auto &soft = soft_phase(cube.field), &stiff = cube.field.batch<StableNeoHookean>();
  std::vector<bool> left;
  left.reserve(stiff.num_elements());
  for (const Tetrahedron& t : stiff.stencils()) left.push_back(!contains(t, 0));
  const auto num_left = std::count(left.begin(), left.end(), true);
  ASSERT_TRUE(0 < num_left && num_left < 40);
  weaken(stiff, [](const Tetrahedron& t) { return contains(t, 0); });
  const PackedVectors far = cube.stretched(3), near = cube.stretched(1.2);
  EXPECT_GT(cube.field.evolve(cube.stretched(1.5), 0.01), 0);
  ASSERT_EQ(enabled(stiff), left);
  const Real before = cube.field.energy(far), added = cube.field.choose_phase(far);
  ASSERT_TRUE(cube.field.is_soft());
  EXPECT_EQ(enabled(soft), left);
  EXPECT_NEAR(cube.field.energy(far), before + added, 1e-12 * before);
  for (const Break& event : soft.breaks()) EXPECT_EQ(event.energy, 0) << "it took none along";

  weaken(soft, [](const Tetrahedron& t) { return contains(t, 26); });
  cube.field.evolve(far, 0.01);
  for (std::size_t t = 0; t < left.size(); ++t) left[t] = left[t] && !contains(stiff.stencils()[t], 26);
  ASSERT_EQ(enabled(soft), left);
  cube.field.choose_phase(near);
  ASSERT_FALSE(cube.field.is_soft());
  EXPECT_EQ(enabled(stiff), left);
}

TEST(TwoPhase, PiecesThatAreWholeAreNearHoweverFarApart) {
  const TetMesh mesh = make_box({4, 1, 1}, {4, 1, 1});
  PotentialField field = make_recovering_field(mesh.vertices, mesh.tetrahedra, rubber);
  PackedVectors x = field.rest_positions();
  for (int i = 0; i < x.cols(); ++i)
    if (x(0, i) > 2.5) x(0, i) += 0.5;  // the third cell
  auto& stiff = field.batch<StableNeoHookean>();
  stiff.set_breaking({.upper = 0.1});
  EXPECT_GT(field.evolve(x, 0.01), 0);
  EXPECT_EQ(field.energy(x), 0);
  for (int i = 0; i < x.cols(); ++i)
    if (x(0, i) > 2.5) x(0, i) += 100;
  EXPECT_EQ(field.choose_phase(x), 0);
  EXPECT_FALSE(field.is_soft());
  EXPECT_LT(field.largest_strain(x), 1e-9);
  x.row(1) *= 3;
  EXPECT_LT(field.choose_phase(x), 0) << "what is left is far from its rest shape";
  const PackedVectors back = field.rest_positions();
  EXPECT_EQ(field.choose_phase(back), 0);
  EXPECT_FALSE(field.is_soft());
}

TEST(TwoPhase, ASpringHoldsWhileATetrahedronAroundItIsWhole) {
  Cube cube;
  PotentialField field =
      make_recovering_field(cube.mesh.vertices, cube.mesh.tetrahedra, rubber, ElasticModel::springs_volumes);
  auto& soft = soft_phase(field);
  auto& springs = field.batch<Length>();
  field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(field.is_soft());
  weaken(soft, [](const Tetrahedron& t) { return contains(t, 13); });  // the middle
  field.evolve(cube.stretched(3), 0.01);
  field.choose_phase(field.rest_positions());
  ASSERT_FALSE(field.is_soft());
  int num_broken = 0;
  for (int e = 0; e < static_cast<int>(springs.num_elements()); ++e) {
    const Edge& edge = springs.stencils()[e];
    bool is_held = false;
    for (const Tetrahedron& t : cube.mesh.tetrahedra)
      is_held = is_held || (contains(t, edge[0]) && contains(t, edge[1]) && !contains(t, 13));
    EXPECT_EQ(springs.is_enabled(e), is_held) << e;
    num_broken += !is_held;
  }
  EXPECT_GT(num_broken, 0);

  // A spring that breaks takes all tetrahedra around it along.
  int one = 0;
  while (!springs.is_enabled(one)) ++one;
  const Edge edge = springs.stencils()[one];
  weaken(springs, [&](const Edge& other) { return other == edge; });
  PackedVectors x = field.rest_positions();
  for (const int i : edge) x.col(i) += (x.col(i) - (x.col(edge[0]) + x.col(edge[1])) / 2) * 0.5;
  field.evolve(x, 0.01);
  ASSERT_FALSE(springs.is_enabled(one));
  field.choose_phase(cube.stretched(3));
  ASSERT_TRUE(field.is_soft());
  for (int t = 0; t < static_cast<int>(soft.num_elements()); ++t) {
    const Tetrahedron& corners = soft.stencils()[t];
    EXPECT_EQ(soft.is_enabled(t), !contains(corners, 13) && !(contains(corners, edge[0]) && contains(corners, edge[1])))
        << t;
  }
}

TEST(TwoPhase, AStateFromBeforeTheBreakIsWhole) {
  Cube cube;
  const PackedVectors far = cube.stretched(3);
  cube.field.batch<StableNeoHookean>().set_breaking({.upper = 0.1});
  const FieldState whole = cube.field.state();
  cube.field.evolve(cube.stretched(1.5), 0.01);
  EXPECT_EQ(cube.field.choose_phase(far), 0);
  ASSERT_FALSE(cube.field.is_soft()) << "nothing is left that is far";
  cube.field.set_state(whole);
  EXPECT_LT(cube.field.choose_phase(far), 0);
  EXPECT_TRUE(cube.field.is_soft());
  EXPECT_EQ(soft_phase(cube.field).breaks().size(), 0u);
}

TEST(TwoPhase, RefusesWhatDoesNotFitTogether) {
  const TetMesh one = make_box({1, 1, 1}, {1, 1, 1}), two = make_box({1, 1, 1}, {2, 1, 1});
  const auto field_of = [](const TetMesh& mesh) { return make_elastic_field(mesh.vertices, mesh.tetrahedra, rubber); };
  const auto complaint_of = [&](std::span<const Tetrahedron> tetrahedra, PotentialField soft,
                                const PhaseThresholds& thresholds = {}) {
    PotentialField field = field_of(one);
    const std::string message =
        complaint<std::invalid_argument>([&] { field.add_soft_phase(tetrahedra, std::move(soft), thresholds); });
    EXPECT_EQ(field.potentials().size(), 2u) << "a refused phase was added";
    return message;
  };
  EXPECT_EQ(complaint_of(one.tetrahedra, field_of(two)), "field: the soft phase has 12 particles, this one 8");
  EXPECT_EQ(complaint_of(one.tetrahedra, field_of(one), {.enter = 0.2}),
            "two phases: thresholds are 0.2 to enter and 0.3 to leave, must be 0 < leave <= enter");
  EXPECT_TRUE(complaint_of(two.tetrahedra, field_of(one)).starts_with("two phases: tetrahedron "));
  const std::vector<Tetrahedron> flat{{0, 1, 2, 1}};
  EXPECT_EQ(complaint_of(flat, field_of(one)), "two phases: tetrahedron 0 has no volume at rest");
  EXPECT_EQ(complaint_of(one.tetrahedra, make_recovering_field(one.vertices, one.tetrahedra, rubber)),
            "field: one of the phases is of two phases itself");
}

}  // namespace
}  // namespace penalty::testing
