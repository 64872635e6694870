// Back to the rest shape without a world: what always succeeds, and what is known to fail.
#include <gtest/gtest.h>

#include <thread>

#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"
#include "penalty/stepping/relax.h"
#include "recovery.h"
#include "scenes/shape_measure.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace {

const Material jelly{.young = 1e5, .poisson = 0.35};
const Material stiff_bulk{.young = 1e5, .poisson = 0.45};  // lambda = 9 mu

struct Outcome {
  RelaxReport report;
  Real rest_error;
  PackedVectors positions;
  bool recovered() const { return rest_error < recovered_below; }
};

Outcome relaxed(PotentialField field, const TetMesh& mesh, Start start, std::uint32_t seed) {
  Outcome outcome{.report = {}, .rest_error = 0, .positions = pack(start_positions(mesh.vertices, start, seed))};
  outcome.report = relax(field, outcome.positions);
  outcome.rest_error = ShapeMeasure(mesh.vertices, mesh.tetrahedra).rest_error(outcome.positions);
  return outcome;
}

Outcome recovering(const TetMesh& mesh, Start start, std::uint32_t seed, const Material& material = jelly) {
  return relaxed(make_recovering_field(mesh.vertices, mesh.tetrahedra, material), mesh, start, seed);
}

TetMesh cube(int cells) { return make_box({1, 1, 1}, {cells, cells, cells}); }

TEST(StaticRecovery, SucceedsFromEveryStart) {
  for (const int cells : {2, 4})
    for (const Start start : all_starts()) {
      const Outcome outcome = recovering(cube(cells), start, 1);
      EXPECT_TRUE(outcome.report.converged()) << name_of(start) << ": " << outcome.report.message();
      EXPECT_LT(outcome.rest_error, 1e-6) << name_of(start) << ", " << cells << " cells";
      EXPECT_EQ(outcome.report.unfolded, start == Start::plane || start == Start::line || start == Start::point);
    }
}

TEST(StaticRecovery, SucceedsFromEveryScramble) {
  struct Case {
    int cells;
    std::uint32_t seeds;
  };
  for (const auto& [cells, seeds] : {Case{2, 100}, Case{4, 20}, Case{6, 3}})
    for (std::uint32_t seed = 1; seed <= seeds; ++seed) {
      const Outcome outcome = recovering(cube(cells), Start::scramble, seed);
      ASSERT_LT(outcome.rest_error, 1e-6) << cells << " cells, seed " << seed << ": " << outcome.report.message();
    }
}

TEST(StaticRecovery, OfASlenderBody) {
  const TetMesh beam = make_beam(2);
  for (std::uint32_t seed = 1; seed <= 5; ++seed)
    EXPECT_LT(recovering(beam, Start::scramble, seed).rest_error, 1e-6) << "seed " << seed;
}

TEST(StaticRecovery, OfARoundBody) {
  const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
  for (std::uint32_t seed = 1; seed <= 3; ++seed)
    EXPECT_LT(recovering(torus, Start::scramble, seed).rest_error, 1e-6) << "seed " << seed;
}

TEST(StaticRecovery, OfStiffBulkNeedsTwoPhases) {
  int direct = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const TetMesh mesh = cube(4);
    EXPECT_LT(recovering(mesh, Start::scramble, seed, stiff_bulk).rest_error, 1e-6) << "seed " << seed;
    const Outcome outcome =
        relaxed(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiff_bulk, ElasticModel::neo_hookean), mesh,
                Start::scramble, seed);
    direct += outcome.recovered();
  }
  EXPECT_LE(direct, 2) << "without two phases it winds itself up";
}

TEST(StaticRecovery, OfSpringsAloneFails) {
  int recovered = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const TetMesh mesh = cube(2);
    PotentialField springs(mesh.vertices);
    springs.add<Length>(edges_of(mesh.tetrahedra), 1);
    const Outcome outcome = relaxed(std::move(springs), mesh, Start::scramble, seed);
    recovered += outcome.recovered();
    EXPECT_GE(outcome.report.energy, 0);
  }
  EXPECT_EQ(recovered, 0) << "a length knows no inside and outside";
}

TEST(StaticRecovery, OfSpringsAndVolumesIsARateNotAPromise) {
  // mu = 1: K = 15 mu v_e of the edges, 0.75 mu V of the tetrahedra.
  const TetMesh mesh = cube(2);
  const std::vector<Edge> edges = edges_of(mesh.tetrahedra);
  const std::vector<Real> volumes = signed_volumes(mesh.vertices, mesh.tetrahedra);
  std::vector<Real> lengths_k = edge_volume_shares(edges, mesh.tetrahedra, volumes), volumes_k = volumes;
  for (Real& k : lengths_k) k *= 15;
  for (Real& k : volumes_k) k *= 0.75;
  int recovered = 0;
  constexpr int runs = 60;
  for (std::uint32_t seed = 1; seed <= runs; ++seed) {
    PotentialField field(mesh.vertices);
    field.add<Length>(edges, lengths_k);
    field.add<TetrahedronVolume>(mesh.tetrahedra, volumes_k);
    recovered += relaxed(std::move(field), mesh, Start::scramble, seed).recovered();
  }
  RecordProperty("recovered", recovered);
  EXPECT_GT(recovered, runs / 2);
  EXPECT_LT(recovered, runs);
}

TEST(StaticRecovery, ComesToTheSameBitsOnAnyNumberOfThreads) {
  constexpr std::size_t runs = 8;
  const auto hashes_on = [](std::size_t threads) {
    std::vector<std::uint64_t> hashes(runs);
    std::vector<std::thread> workers;
    workers.reserve(threads);
    for (std::size_t t = 0; t < threads; ++t)
      workers.emplace_back([&hashes, t, threads] {
        for (std::size_t run = t; run < runs; run += threads)
          hashes[run] = hash_of(recovering(cube(3), Start::scramble, static_cast<std::uint32_t>(run)).positions);
      });
    for (std::thread& worker : workers) worker.join();
    return hashes;
  };
  const std::vector<std::uint64_t> one = hashes_on(1);
  EXPECT_NE(one[0], one[1]);
  EXPECT_EQ(hashes_on(2), one);
  EXPECT_EQ(hashes_on(5), one);
}

}  // namespace
}  // namespace penalty::demo
