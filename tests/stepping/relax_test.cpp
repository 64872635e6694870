#include "penalty/stepping/relax.h"

#include <limits>

#include "fields/meshes.h"

namespace penalty::testing {
namespace {

const Material steel{.young = 1e6, .poisson = 0.3};

PotentialField make_cube(int cells = 3, const Material& material = steel) {
  const TetMesh mesh = make_box({1, 1, 1}, {cells, cells, cells});
  return make_elastic_field(mesh.vertices, mesh.tetrahedra, material, ElasticModel::neo_hookean);
}

TEST(Relax, FindsBackToRestFromADeformedState) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Random random(seed);
    PotentialField field = make_cube();
    PackedVectors x = deformed(field.rest_positions(), 0.05, random);
    ASSERT_GT(field.energy(x), 1);
    const RelaxReport report = relax(field, x);
    EXPECT_TRUE(report.converged()) << report.message();
    EXPECT_LT(report.energy, 1e-9);
    for (const auto& [a, b] : edges_of(make_box({1, 1, 1}, {3, 3, 3}).tetrahedra)) {
      const Real rest = (field.rest_positions().col(a) - field.rest_positions().col(b)).norm();
      EXPECT_NEAR((x.col(a) - x.col(b)).norm(), rest, 1e-8);
    }
  }
}

TEST(Relax, OnlyLowersTheEnergyAndCanBeWatched) {
  Random random(7);
  PotentialField field = make_cube();
  PackedVectors x = deformed(field.rest_positions(), 0.3, random);
  std::vector<RelaxProgress> seen;
  const Real start = field.energy(x);
  Real last = start;
  RelaxOptions options;
  options.observe = [&](const RelaxProgress& progress) {
    EXPECT_LE(progress.energy, last + 1e-9) << "round-off of a body of 1 MPa";
    last = progress.energy;
    EXPECT_NEAR(field.energy(*progress.positions), progress.energy, 1e-12 * start);
    EXPECT_EQ(progress.iteration, static_cast<int>(seen.size()) + 1);
    seen.push_back(progress);
    return true;
  };
  const RelaxReport report = relax(field, x, options);
  ASSERT_TRUE(report.converged()) << report.message();
  ASSERT_GT(seen.size(), 3u);
  EXPECT_EQ(report.iterations, static_cast<int>(seen.size()) + 1);  // the last one is in the report
  EXPECT_LT(report.step, 1e-9 * std::sqrt(3.0));
}

TEST(Relax, CanBeCancelled) {
  Random random(7);
  PotentialField field = make_cube();
  PackedVectors x = deformed(field.rest_positions(), 0.3, random);
  const Real start = field.energy(x);
  RelaxOptions options;
  options.observe = [](const RelaxProgress& progress) { return progress.iteration < 2; };
  const RelaxReport report = relax(field, x, options);
  EXPECT_EQ(report.end, RelaxEnd::cancelled);
  EXPECT_EQ(report.iterations, 2);
  EXPECT_LT(field.energy(x), start) << "what was reached is kept";
  EXPECT_DOUBLE_EQ(field.energy(x), report.energy);
  EXPECT_EQ(report.message().rfind("cancelled after 2 iterations, energy ", 0), 0u) << report.message();
}

TEST(Relax, SaysWhenTheIterationsRanOut) {
  Random random(7);
  PotentialField field = make_cube();
  PackedVectors x = deformed(field.rest_positions(), 0.3, random);
  const RelaxReport report = relax(field, x, {.max_iterations = 1});
  EXPECT_EQ(report.end, RelaxEnd::iteration_limit);
  EXPECT_EQ(report.message().rfind("stopped by the limit after 1 iterations", 0), 0u) << report.message();
  EXPECT_GT(report.residual, 0);
}

TEST(Relax, BalancesLoadsAgainstPins) {
  // A chain of springs that hangs: each carries what hangs below it, C = weight L0 / K.
  Eigen::Matrix3Xd rest(3, 5);
  std::vector<Edge> edges;
  for (int i = 0; i < 5; ++i) rest.col(i) = Vector3(0, -0.2 * i, 0);
  edges.reserve(4);
  for (int i = 0; i < 4; ++i) edges.push_back({i, i + 1});
  PotentialField field(rest);
  field.add<Length>(edges, 30);
  PackedVectors x = field.rest_positions();
  RelaxOptions options;
  options.pinned = {0};
  options.loads = PackedVectors::Zero(4, 5);
  options.loads.row(1).setConstant(-0.7);
  const RelaxReport report = relax(field, x, options);
  EXPECT_TRUE(report.converged()) << report.message();
  EXPECT_EQ(x.col(0), field.rest_positions().col(0));
  for (int i = 0; i < 4; ++i) {
    const Real tension = 0.7 * (4 - i);
    EXPECT_NEAR((x.col(i + 1) - x.col(i)).norm(), 0.2 * (1 + tension * 0.2 / 30), 1e-9);
  }
  EXPECT_LT(report.residual, 1e-6);
}

TEST(Relax, AgreesWithALinearSolutionForSmallLoads) {
  // The bending of a beam under loads so small that it is linear: K u = f by a dense factorisation.
  const TetMesh mesh = make_box({2, 0.5, 0.5}, {4, 1, 1});
  PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, steel);
  RelaxOptions options;
  options.tolerance = 1e-13;
  options.linear.tolerance = 1e-6;
  options.linear.max_iterations = 500;
  options.loads = PackedVectors::Zero(4, field.num_particles());
  Eigen::MatrixXd k = assembled(field, field.rest_positions(), StiffnessModel::exact).to_dense();
  Eigen::VectorXd f = Eigen::VectorXd::Zero(k.rows());
  for (int i = 0; i < field.num_particles(); ++i) {
    if (mesh.vertices(0, i) == 0) {
      options.pinned.push_back(i);
      k.middleRows<3>(3 * i).setZero();
      k.middleCols<3>(3 * i).setZero();
      k.block<3, 3>(3 * i, 3 * i).setIdentity();
    } else {
      f[3 * i + 1] = options.loads(1, i) = -1e-3;
    }
  }
  const Eigen::VectorXd u = k.ldlt().solve(f);
  PackedVectors x = field.rest_positions();
  const RelaxReport report = relax(field, x, options);
  ASSERT_TRUE(report.converged()) << report.message();
  const Eigen::VectorXd moved = (x - field.rest_positions()).topRows<3>().reshaped();
  EXPECT_LT((moved - u).norm(), 1e-5 * u.norm());
}

TEST(Relax, UnfoldsExactlyFlatStarts) {
  for (const int kept : {0, 1, 2}) {
    PotentialField field = make_cube(2);
    PackedVectors x = field.rest_positions();
    x.middleRows(kept, 3 - kept).setZero();
    const RelaxReport report = relax(field, x);
    EXPECT_TRUE(report.unfolded);
    EXPECT_TRUE(report.converged()) << report.message();
    EXPECT_LT(report.energy, 1e-9) << kept << " dimensions left";
  }
}

TEST(Relax, GivesTheSameBitsTwice) {
  PackedVectors results[2];
  for (PackedVectors& x : results) {
    Random random(3);
    PotentialField field = make_cube();
    x = deformed(field.rest_positions(), 0.4, random);
    relax(field, x);
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(Relax, LeavesNothingToDoAlone) {
  PotentialField empty((Eigen::Matrix3Xd(3, 0)));
  PackedVectors none(4, 0);
  EXPECT_TRUE(relax(empty, none).converged());
  PotentialField field = make_cube(1);
  PackedVectors x = field.rest_positions();
  EXPECT_TRUE(relax(field, x).converged());
  EXPECT_EQ(x, field.rest_positions());
}

TEST(Relax, SaysWhatIsWrongWithItsInput) {
  PotentialField field = make_cube(1);
  const PackedVectors rest = field.rest_positions();
  const auto complaint_of = [&](PackedVectors x, const RelaxOptions& options) {
    return complaint<std::invalid_argument>([&] { relax(field, x, options); });
  };
  EXPECT_EQ(complaint_of(rest.leftCols(7), {}), "relax: 7 positions for 8 particles");
  PackedVectors bad = rest;
  bad(1, 3) = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_EQ(complaint_of(bad, {}), "relax: position 3: coordinate y is nan");
  RelaxOptions options;
  options.loads = PackedVectors::Zero(4, 2);
  EXPECT_EQ(complaint_of(rest, options), "relax: 2 loads for 8 particles");
  EXPECT_EQ(complaint_of(rest, {.pinned = {2, 8}}), "relax: pinned particle 8 is outside the 8 of the field");
  EXPECT_EQ(complaint_of(rest, {.max_iterations = -1}), "relax: max_iterations is -1, must be zero or positive");
  EXPECT_EQ(complaint_of(rest, {.tolerance = 0}), "relax: tolerance is 0, must be positive");
  EXPECT_EQ(complaint_of(rest, {.linear = {.max_iterations = 0}}),
            "relax: linear.max_iterations is 0, must be at least 1");
  EXPECT_EQ(complaint_of(rest, {.linear = {.tolerance = 1}}), "relax: linear.tolerance is 1, must be in (0, 1)");
}

TEST(Relax, RefusesAStartWhosePotentialOverflows) {
  PotentialField field = make_cube(1);
  PackedVectors x = 1e200 * field.rest_positions();
  const PackedVectors before = x;
  const RelaxReport report = relax(field, x);
  EXPECT_EQ(report.end, RelaxEnd::not_finite);
  EXPECT_EQ(x, before);
}

}  // namespace
}  // namespace penalty::testing
