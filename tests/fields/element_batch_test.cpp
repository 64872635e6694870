// What may change about the elements of a batch, and what it refuses.
#include "fields/meshes.h"
#include "penalty/fields/batch_loops.h"

namespace penalty::testing {
namespace {

struct Strip {
  PotentialField field{(Eigen::Matrix3Xd(3, 4) << 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0).finished()};
  Batch<Length>& springs = field.add<Length>(std::vector<Edge>{{0, 1}, {1, 2}, {2, 3}}, 10);

  PackedVectors stretched(Real factor) const {
    PackedVectors x = field.rest_positions();
    x.row(0) *= factor;
    return x;
  }
};

std::string refusal(const std::function<void(Batch<Length>&)>& change) {
  Strip strip;
  return complaint<std::invalid_argument>([&] { change(strip.springs); });
}

TEST(ElementBatch, RefusalsNameBatchElementAndValue) {
  using B = Batch<Length>&;
  const Real nan = std::nan("");
  EXPECT_EQ(refusal([](B b) { b.set_target(3, 0); }), "length: there is no element 3 among the 3");
  EXPECT_EQ(refusal([](B b) { b.set_enabled(-1, true); }), "length: there is no element -1 among the 3");
  EXPECT_EQ(refusal([&](B b) { b.set_target(1, nan); }), "length 1: target is nan, must be finite");
  EXPECT_EQ(refusal([](B b) { b.set_stiffness(2, -1); }), "length 2: stiffness is -1 J, must be positive and finite");
  EXPECT_EQ(refusal([](B b) { b.set_stiffness(2, infinite); }),
            "length 2: stiffness is inf J, must be positive and finite");
  EXPECT_EQ(refusal([](B b) { b.set_free_play(0, 0.2, 0.1); }), "length 0: free play from 0.2 to 0.1 is empty");
  EXPECT_EQ(refusal([&](B b) { b.set_free_play(0, nan, 0.1); }), "length 0: free play from nan to 0.1 is empty");
  EXPECT_EQ(refusal([](B b) { b.set_free_play(0, infinite, infinite); }),
            "length 0: free play from inf to inf has no finite strain");
  EXPECT_EQ(refusal([](B b) { b.set_damping_time(1, -0.1); }),
            "length 1: damping time is -0.1 s, must be zero or positive");
  EXPECT_EQ(refusal([](B b) { b.set_plasticity(1, {.yield = -2}); }),
            "plasticity: yield is -2, must be zero or positive");
  EXPECT_EQ(refusal([](B b) { b.set_breaking(1, {.upper = -2}); }), "breaking: upper strain is -2, must be positive");
}

TEST(ElementBatch, AnEnergyOfItsOwnHasNoTarget) {
  const TetMesh mesh = make_box({1, 1, 1}, {1, 1, 1});
  PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{}, ElasticModel::neo_hookean);
  ElementBatch& batch = *field.find("stable neo-Hookean");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { batch.set_target(2, 0.1); }),
            "stable neo-Hookean 2: an energy of its own has no target");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { batch.set_plasticity({.yield = 0.1}); }),
            "stable neo-Hookean 0: an energy of its own has no plastic flow");
}

TEST(ElementBatch, FreePlayOfAnEnergyHoldsItsRestState) {
  const TetMesh mesh = make_box({1, 1, 1}, {1, 1, 1});
  PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{}, ElasticModel::neo_hookean);
  ElementBatch& batch = *field.find("stable neo-Hookean");
  EXPECT_NO_THROW(batch.set_free_play(0, -infinite, 0.1));
  EXPECT_EQ(
      complaint<std::invalid_argument>([&] { batch.set_free_play(0, 0.1, 0.2); }),
      "stable neo-Hookean 0: free play from 0.1 to 0.2 must hold 0 and end: an energy of its own is zero at rest and "
      "nowhere negative");
  EXPECT_THROW(batch.set_free_play(0, 0, infinite), std::invalid_argument);
}

TEST(ElementBatch, TargetOfAnAngleIsReachedTheShorterWayRound) {
  // A hinge folded to 3.1 rad and, a moment later, past the full turn, with target 3.0.
  PotentialField field((Eigen::Matrix3Xd(3, 4) << 0, 0, -1, 1, 0, 1, 0.5, 0.5, 0, 0, 0, 0).finished());
  Batch<BendingAngle>& hinge = field.add<BendingAngle>(std::vector<std::array<int, 4>>{{0, 1, 2, 3}}, 1);
  const auto folded = [&](Real angle) {
    PackedVectors x = field.rest_positions();
    x.col(3).head<3>() = Vector3(std::cos(angle), 0.5, std::sin(angle));
    return x;
  };
  std::vector<Real> strains;
  strains.push_back(penalty::strains(hinge, folded(1))[0]);
  const Real sign = strains[0] > 0 ? 1 : -1;
  hinge.set_target(0, 3.0);
  strains.clear();
  strains.push_back(penalty::strains(hinge, folded(sign * 3.1))[0]);
  strains.push_back(penalty::strains(hinge, folded(sign * 3.2))[0]);
  EXPECT_NEAR(strains[0], 0.1, 1e-12);
  EXPECT_NEAR(strains[1], 0.2, 1e-12);
}

/// Has no value for points left of the origin.
struct Logarithm {
  static constexpr std::string_view name = "logarithm";
  static constexpr int num_points = 1;
  static Logarithm at_rest(const Points<1>& p) { return {std::log(p.x())}; }
  Real value(const Points<1>& p) const { return std::log(p.x()) - rest; }
  Gradient<1> gradient(const Points<1>& p) const { return {1 / p.x(), 0, 0}; }
  Real rest;
};

TEST(ElementBatch, WhatIsSwitchedOffIsNotEvaluated) {
  PotentialField field((Eigen::Matrix3Xd(3, 1) << 1, 0, 0).finished());
  Batch<Logarithm>& batch = field.add<Logarithm>(std::vector<std::array<int, 1>>{{0}}, 1);
  PackedVectors x = -field.rest_positions(), f = PackedVectors::Zero(4, 1);
  batch.set_enabled(0, false);
  EXPECT_EQ(field.add_forces(x, f), 0);
  EXPECT_EQ(f.norm(), 0);
}

TEST(ElementBatch, TargetsMoveTheRestLength) {
  Strip strip;
  strip.springs.set_targets(0.25);
  EXPECT_EQ(strip.springs.target(1), 0.25);
  EXPECT_EQ(strip.field.energy(strip.stretched(1.25)), 0);
  EXPECT_NEAR(strip.field.energy(strip.field.rest_positions()), 3 * 10.0 / 2 * 0.0625, 1e-15);
}

TEST(ElementBatch, PlasticStrainAndTargetAddUp) {
  Strip strip;
  strip.springs.set_target(0, 0.1);
  strip.springs.set_plasticity({.yield = 0.05});
  EXPECT_GT(strip.field.evolve(strip.stretched(1.5), 0.01), 0);
  EXPECT_NEAR(strip.springs.plastic_strain(0), 0.5 - 0.1 - 0.05, 1e-15);
  EXPECT_NEAR(strip.springs.plastic_strain(1), 0.5 - 0.05, 1e-15);
  EXPECT_NEAR(strip.springs.target(0), 0.1, 1e-15);
  strip.springs.set_target(0, 0.2);  // the plastic part stays
  const std::vector<Real> strains = penalty::strains(strip.field, strip.stretched(1.5));
  EXPECT_NEAR(strains[0], -0.05, 1e-15);
  EXPECT_NEAR(strains[1], 0.05, 1e-15);
  EXPECT_EQ(strip.field.evolve(strip.stretched(1.5), 0.01), 0);
}

TEST(ElementBatch, BrokenElementsLeaveAndAreReported) {
  Strip strip;
  strip.springs.set_breaking(1, {.upper = 0.4});
  strip.springs.set_breaking(2, {.upper = 0.6});
  const PackedVectors x = strip.stretched(1.5);
  const Real before = strip.field.energy(x);
  EXPECT_NEAR(strip.field.evolve(x, 0.01), 1.25, 1e-14);
  ASSERT_EQ(strip.springs.breaks().size(), 1u);
  EXPECT_EQ(strip.springs.breaks()[0].element, 1);
  EXPECT_NEAR(strip.springs.breaks()[0].strain, 0.5, 1e-15);
  EXPECT_NEAR(strip.springs.breaks()[0].energy, 1.25, 1e-14);
  EXPECT_NEAR(strip.field.energy(x), before - 1.25, 1e-14);
  EXPECT_FALSE(strip.springs.is_enabled(1));
  EXPECT_EQ(strip.field.evolve(x, 0.01), 0) << "broken twice";
  strip.springs.set_enabled(1, true);
  EXPECT_NEAR(strip.field.energy(x), before, 1e-14);
}

TEST(ElementBatch, StateIsAMementoThatGoesBackAndForth) {
  Strip strip;
  strip.springs.set_plasticity({.yield = 0.05});
  strip.springs.set_breaking(1, {.upper = 0.04});
  const PackedVectors x = strip.stretched(1.3);
  const FieldState before = strip.field.state();
  const Real energy_before = strip.field.energy(x);
  EXPECT_GT(strip.field.evolve(x, 1), 0);
  const FieldState after = strip.field.state();
  const Real energy_after = strip.field.energy(x);
  EXPECT_LT(energy_after, energy_before);
  ASSERT_EQ(strip.springs.breaks().size(), 1u);
  strip.field.set_state(before);
  EXPECT_EQ(strip.field.energy(x), energy_before);
  EXPECT_TRUE(strip.springs.breaks().empty());
  EXPECT_EQ(strip.springs.plastic_strain(0), 0);
  EXPECT_EQ(strip.field.state().values, before.values);
  strip.field.set_state(after);
  EXPECT_EQ(strip.field.energy(x), energy_after);
  ASSERT_EQ(strip.springs.breaks().size(), 1u);
  EXPECT_EQ(strip.springs.breaks()[0].element, 1);
  EXPECT_FALSE(strip.springs.is_enabled(1));
}

TEST(ElementBatch, StateBeforeAnyModifierIsThatOfTheElementsAsTheyWereAdded) {
  Strip strip;
  const FieldState fresh = strip.field.state();
  strip.springs.set_targets(0.2);
  strip.springs.set_free_play(0, -infinite, 0);
  strip.springs.set_enabled(2, false);
  strip.field.set_state(fresh);
  EXPECT_EQ(strip.springs.target(1), 0);
  EXPECT_TRUE(strip.springs.is_enabled(2));
  EXPECT_NEAR(strip.field.energy(strip.stretched(0.9)), 2 * 10.0 / 2 * 0.1 * 0.1, 1e-15) << "free play is no state";
}

TEST(ElementBatch, RefusesTheStateOfAnotherField) {
  Strip strip, broken;
  broken.springs.set_breaking({.upper = 0.1});
  FieldState state = broken.field.state();
  state.values.pop_back();
  EXPECT_EQ(complaint<std::invalid_argument>([&] { strip.field.set_state(state); }),
            "length: the state ends early, after 7 of 8 numbers");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { strip.field.set_state({{3, 0, 7, 0, 0}}); }),
            "length: the state is not one of these 3 elements: it holds 7");
  EXPECT_EQ(complaint<std::invalid_argument>([&] { strip.field.set_state({{0, 0, 0, 0, 0, 1}}); }),
            "field: the state holds 1 numbers too many");
}

TEST(ElementBatch, StiffnessOfADisabledElementIsKeptAndMayBeChanged) {
  Strip strip;
  strip.springs.set_enabled(1, false);
  EXPECT_EQ(strip.springs.stiffness(1), 10);
  strip.springs.set_stiffness(1, 20);
  EXPECT_FALSE(strip.springs.is_enabled(1));
  strip.springs.set_enabled(1, true);
  EXPECT_EQ(strip.springs.stiffness(1), 20);
  EXPECT_EQ(strip.springs.stiffnesses()[1], 20);
}

TEST(ElementBatch, VersionGrowsWithWhatMayRaiseTheStiffnessOnly) {
  Strip strip;
  std::uint64_t version = strip.field.stiffness_version();
  const auto grows = [&] { return std::exchange(version, strip.field.stiffness_version()) != version; };
  strip.springs.set_stiffness(0, 5);
  EXPECT_TRUE(grows());
  strip.springs.set_targets(-0.2);
  strip.springs.set_free_play(-infinite, 0);
  strip.springs.set_damping_time(0.1);
  strip.springs.set_enabled(0, false);
  EXPECT_FALSE(grows());
  strip.springs.set_enabled(0, true);
  EXPECT_TRUE(grows());
  strip.field.add<Length>(std::vector<Edge>{{0, 3}}, 1);
  EXPECT_TRUE(grows());
}

TEST(ElementBatch, LedgerSaysHowManyHowMuchAndWhere) {
  Strip strip;
  strip.field.add<Length>(std::vector<Edge>{{0, 3}}, 4, "brace");
  strip.springs.set_enabled(0, false);
  PackedVectors x = strip.field.rest_positions();
  x(0, 3) = 3.5;
  const std::vector<LedgerEntry> ledger = penalty::ledger(strip.field, x);
  ASSERT_EQ(ledger.size(), 2u);
  EXPECT_EQ(ledger[0].name, "length");
  EXPECT_EQ(ledger[0].num_elements, 3u);
  EXPECT_EQ(ledger[0].num_enabled, 2u);
  EXPECT_NEAR(ledger[0].energy, 1.25, 1e-15);
  EXPECT_NEAR(ledger[0].mean_strain, 0.25, 1e-15);
  EXPECT_NEAR(ledger[0].largest_strain, 0.5, 1e-15);
  EXPECT_EQ(ledger[0].largest_element, 2);
  EXPECT_EQ(ledger[1].name, "brace");
  EXPECT_NEAR(ledger[1].energy, 4.0 / 2 / 36, 1e-15);
  EXPECT_EQ(strip.field.find("brace"), strip.field.potentials()[1].get());
}

TEST(PotentialField, NamesTheBatchInItsErrors) {
  Strip strip;
  EXPECT_EQ(
      complaint<std::invalid_argument>([&] { strip.field.add<Length>(std::vector<Edge>{{0, 1}, {2, 2}}, 1, "brace"); }),
      "brace 1: index 2 appears twice");
}

TEST(PotentialField, GroupsOfAnySizeAreCheckedLikeOthers) {
  Random random(2);
  PotentialField field(random.vectors<Eigen::Dynamic>(12, 1));
  const auto refusal_of = [&](std::vector<int> stencil) {
    return complaint<std::invalid_argument>(
        [&] { field.add(ShapeMatch(), std::vector<std::vector<int>>{stencil}, 1); });
  };
  EXPECT_EQ(refusal_of({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 4}), "shape match 0: index 4 appears twice");
  EXPECT_EQ(refusal_of({0, 1, 12}), "shape match 0: index 12 is outside the 12 particles");
  EXPECT_TRUE(refusal_of({0, 1}).starts_with("shape match 0: ")) << refusal_of({0, 1});
  EXPECT_TRUE(field.potentials().empty());
}

/// A kind of somebody's own with a mistake in its gradient.
struct Wrong {
  static constexpr std::string_view name = "wrong";
  static constexpr int num_points = 2;
  static Wrong at_rest(const Points<2>&) { return {}; }
  Real value(const Points<2>& p) const { return (p.col(1) - p.col(0)).squaredNorm(); }
  Gradient<2> gradient(const Points<2>& p) const {
    Gradient<2> g;
    g << p.col(0) - p.col(1), p.col(1) - p.col(0);  // a factor of 2 is missing
    return g;
  }
};

TEST(PotentialField, RefusesAKindWhoseGradientIsWrongAndSaysBothNumbers) {
  PotentialField field((Eigen::Matrix3Xd(3, 2) << 0, 1, 0, 0, 0, 0).finished());
  const std::string message = complaint<std::invalid_argument>([&] { field.add<Wrong>(std::vector<Edge>{{0, 1}}, 1); });
  EXPECT_TRUE(message.starts_with("wrong 0: at rest, dC/dp")) << message;
  EXPECT_NE(message.find("is -1"), std::string::npos) << message;
  EXPECT_NE(message.find("differences give -2"), std::string::npos) << message;
  EXPECT_TRUE(field.potentials().empty());
}

/// An energy of somebody's own with a mistake in its gradient.
struct WrongEnergy {
  static constexpr std::string_view name = "wrong energy";
  static constexpr int num_points = 2;
  static WrongEnergy at_rest(const Points<2>& rest) { return {(rest.col(1) - rest.col(0)).norm()}; }
  Real energy(const Points<2>& p) const {
    const Real stretch = (p.col(1) - p.col(0)).norm() - length;
    return stretch * stretch;
  }
  Real energy_and_gradient(const Points<2>& p, Gradient<2>& g) const {
    const Vector3 edge = p.col(1) - p.col(0);
    const Vector3 slope = (edge.norm() - length) / edge.norm() * edge;  // a factor of 2 is missing
    g << -slope, slope;
    return energy(p);
  }
  Hessian<2> energy_hessian(const Points<2>&) const { return Hessian<2>::Zero(); }
  Real length = 0;
};

TEST(PotentialField, RefusesAnEnergyWhoseGradientIsWrongAndSaysBothNumbers) {
  PotentialField field((Eigen::Matrix3Xd(3, 2) << 0, 1, 0, 0, 0, 0).finished());
  const std::string message =
      complaint<std::invalid_argument>([&] { field.add<WrongEnergy>(std::vector<Edge>{{0, 1}}, 1); });
  EXPECT_TRUE(message.starts_with("wrong energy 0: near rest, dpsi/dp")) << message;
  EXPECT_NE(message.find("central differences give"), std::string::npos) << message;
  EXPECT_TRUE(field.potentials().empty());
}

}  // namespace
}  // namespace penalty::testing
