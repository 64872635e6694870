#include "penalty/stepping/stable_step.h"

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

TEST(EigenvalueBound, IsTheTrueLargestOrAtMostOnePerCentAboveIt) {
  WorstError above;
  for (unsigned seed = 0; seed < 24; ++seed) {
    Random random(seed);
    const TetMesh mesh = noisy_box({1 + static_cast<int>(random.index(4)), 2, 1 + static_cast<int>(random.index(3))},
                                   0.3, random.uniform(0, 0.15), random);
    const Real poisson = random.uniform(0.26, 0.49);
    const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{1e5, poisson, 1000});
    std::vector<Real> inverse_masses = random_inverse_masses(mesh.vertices.cols(), random);
    if (seed % 3 == 0) inverse_masses[1] = 0;    // pinned
    if (seed % 4 == 0) inverse_masses[2] = 1e3;  // one light particle
    for (const PackedVectors& x : {field.rest_positions(), deformed(field.rest_positions(), 0.03, random)}) {
      const Real largest = true_largest_eigenvalue(field, x, inverse_masses);
      const System stiffness = taut_stiffness(field, x);
      const Real bound = largest_eigenvalue_bound(stiffness, inverse_masses);
      EXPECT_GE(bound, largest * (1 - 1e-12)) << "seed " << seed;
      above.see(bound / largest - 1, seed);
      EXPECT_GE(gershgorin_bound(stiffness, inverse_masses), bound);
    }
  }
  above.expect_below(0.01, "relative distance above");
}

TEST(EigenvalueBound, OfTheReferenceBeamIsTight) {
  const Body beam = make_beam_body(2);
  const Real largest =
      true_largest_eigenvalue(*beam.field, beam.field->rest_positions(), beam.particles().inverse_masses);
  EXPECT_GE(beam.body.largest_eigenvalue, largest * (1 - 1e-12));
  EXPECT_LE(beam.body.largest_eigenvalue, 1.01 * largest);
}

TEST(EigenvalueBound, FindsOneStiffSpringAmongManySofterOnes) {
  // Pairs that do not touch: the eigenvalues are 2 K / L0² m, known exactly. The stiffest is hidden among thousands
  // that are spread evenly below it.
  const int pairs = 3000;
  for (const Real stiffest : {1.05, 1.2, 2.0, 100.0}) {
    SCOPED_TRACE("stiffest " + std::to_string(stiffest));
    Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 2 * pairs);
    std::vector<Edge> edges;
    std::vector<Real> stiffnesses;
    for (int k = 0; k < pairs; ++k) {
      rest(0, 2 * k + 1) = 1;
      edges.push_back({2 * k, 2 * k + 1});
      stiffnesses.push_back((k + 1.0) / pairs);
    }
    stiffnesses[pairs / 3] = stiffest;
    PotentialField field(rest);
    field.add<Length>(edges, stiffnesses);
    const std::vector<Real> inverse_masses(2 * pairs, 1.0);
    const Real bound = largest_eigenvalue_bound(taut_stiffness(field, field.rest_positions()), inverse_masses);
    EXPECT_GE(bound, 2 * stiffest * (1 - 1e-12));
    EXPECT_LE(bound, 2 * stiffest * 1.01);
  }
}

TEST(EigenvalueBound, IsClosedFormForOneSpring) {
  Eigen::Matrix3Xd rest(3, 2);
  rest << 0, 3, 0, 4, 0, 0;  // L0 = 5
  PotentialField field(rest);
  const std::vector<Edge> edge{{0, 1}};
  field.add<Length>(edge, 50);
  const System stiffness = taut_stiffness(field, field.rest_positions());
  EXPECT_NEAR(largest_eigenvalue_bound(stiffness, std::vector<Real>{1, 0.5}), 3, 1e-12);
  EXPECT_NEAR(largest_eigenvalue_bound(stiffness, std::vector<Real>{1, 0}), 2, 1e-12);
}

TEST(EigenvalueBound, IsZeroWithoutElementsOrMovableParticles) {
  PotentialField field(Eigen::Matrix3Xd::Identity(3, 3));
  const auto bound = [&field](Real inverse_mass) {
    return largest_eigenvalue_bound(taut_stiffness(field, field.rest_positions()), std::vector<Real>(3, inverse_mass));
  };
  EXPECT_EQ(bound(1), 0);
  const std::vector<Edge> edges{{0, 1}};
  field.add<Length>(edges, 1);
  EXPECT_GT(bound(1), 0);
  EXPECT_EQ(bound(0), 0);
}

TEST(EigenvalueBound, IsTheSameEveryTime) {
  const Body a = make_beam_body(1), b = make_beam_body(1);
  EXPECT_GT(a.body.largest_eigenvalue, 0);
  EXPECT_EQ(a.body.largest_eigenvalue, b.body.largest_eigenvalue);
}

// The largest energy during many substeps of `share` of the critical step 2 / sqrt(largest eigenvalue), over that of
// the start: random velocities so small that the motion is linear.
Real energy_growth(Real share, int substeps) {
  Random random(3);
  const TetMesh mesh = noisy_box({2, 2, 2}, 0.5, 0.1, random);
  Body body = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{1e4, 0.4, 1000}),
                        random_inverse_masses(mesh.vertices.cols(), random));
  const Real largest =
      true_largest_eigenvalue(*body.field, body.field->rest_positions(), body.particles().inverse_masses);
  body.particles().velocities = random_packed(mesh.vertices.cols(), 1e-7, random);
  const Real start = kinetic_energy(body.particles());
  EXPECT_GT(start, 0);
  Real most = 0;
  const int per_step = 10;
  body.body.options.substeps = body.body.options.max_substeps = per_step;
  body.body.options.energy_tolerance = 1e300;
  for (int done = 0; done < substeps; done += per_step) {
    advance(body, per_step * share * 2 / std::sqrt(largest));
    EXPECT_EQ(body.body.report.substeps, per_step);
    if (!body.body.report.finite) return std::numeric_limits<Real>::infinity();
    most = std::max(most, body.energy() / start);
  }
  return most;
}

TEST(CriticalStep, JustBelowItTheMotionIsStable) {
  // Mode by mode, kinetic energy + (1 - (w h)²/4) elastic energy is constant, so the energy never exceeds
  // 1 / (1 - share²) times that of the start: 25.3 times at 0.98.
  const Real growth = energy_growth(0.98, 20000);
  RecordProperty("growth", std::to_string(growth));
  EXPECT_LT(growth, 1 / (1 - 0.98 * 0.98));
  EXPECT_GT(growth, 1);
}

TEST(CriticalStep, JustAboveItTheMotionBlowsUp) {
  // The fastest mode grows by exp(acosh(2 * 1.03² - 1)) = 1.63 a substep.
  EXPECT_GT(energy_growth(1.03, 100), 1e12);
}

TEST(CriticalStep, AutomaticSubstepsStayJustBelowIt) {
  Body beam = make_beam_body(2, {.young = 1e8, .poisson = 0.4});
  const Real duration = 1.0 / 60;
  advance(beam, duration);
  const Real critical = duration * std::sqrt(beam.body.largest_eigenvalue) / 2;
  ASSERT_GT(critical, 10);
  EXPECT_EQ(beam.body.report.substeps, static_cast<int>(std::ceil(critical / beam.body.options.safety)));
}

}  // namespace
}  // namespace penalty::testing
