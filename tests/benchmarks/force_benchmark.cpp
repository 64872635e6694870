// Nanoseconds an element: of one evaluation of the forces alone, as in most substeps, where the argument is the number of
// cells across the beam, and of its projected stiffness.
#include <benchmark/benchmark.h>

#include <random>

#include "reference_beam.h"

namespace {

using namespace penalty;

template <class Kind>
void add_forces(benchmark::State& state) {
  const TetMesh mesh = make_beam(static_cast<int>(state.range(0)));
  const PotentialField field = reference_beam_field(mesh, static_cast<int>(state.range(0)));
  const Potential& batch = *field.find<Kind>();
  PackedVectors x = field.rest_positions(), f = PackedVectors::Zero(4, x.cols());
  x.topRows<3>() *= 1.01;
  for (auto _ : state) {
    batch.add_forces_only(x, f);
    benchmark::ClobberMemory();
  }
  state.counters["time_per_element"] =
      benchmark::Counter(static_cast<double>(batch.num_elements()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// All the elements of a material, a tetrahedron.
void add_material_forces(benchmark::State& state) {
  const TetMesh mesh = make_beam(static_cast<int>(state.range(0)));
  const PotentialField field =
      make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e6, .poisson = 0.4},
                         static_cast<ElasticModel>(state.range(1)));
  PackedVectors x = field.rest_positions(), f = PackedVectors::Zero(4, x.cols());
  x.topRows<3>() *= 1.01;
  for (auto _ : state) {
    field.add_forces_only(x, f);
    benchmark::ClobberMemory();
  }
  state.counters["time_per_tetrahedron"] =
      benchmark::Counter(static_cast<double>(mesh.tetrahedra.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// The positive semidefinite stiffness of one element after another, without assembly; the argument is the noise of the
// points, in percent of a cell: more of it, more negative eigenvalues.
template <class Kind>
void projected_stiffness(benchmark::State& state) {
  const TetMesh mesh = make_beam(4);
  constexpr int n = Kind::num_points;
  std::vector<Points<n>> points;
  std::vector<Kind> kinds;
  std::mt19937 random(1);
  for (const auto& tetrahedron : mesh.tetrahedra) {
    Points<n> rest;
    for (int k = 0; k < n; ++k) rest.col(k) = mesh.vertices.col(tetrahedron[k]);
    if constexpr (std::is_same_v<Kind, StableNeoHookean>)
      kinds.push_back(StableNeoHookean::with_ratio(4).at_rest(rest));
    else
      kinds.push_back(Kind::at_rest(rest));
    for (Real& x : rest.reshaped())
      x += 0.25 * 0.01 * static_cast<Real>(state.range(0)) * (2 * 0x1p-32 * static_cast<Real>(random()) - 1);
    points.push_back(Matrix3(Eigen::AngleAxis<Real>(1, Vector3(0.6, 0, 0.8))) * rest);
  }
  for (auto _ : state)
    for (std::size_t e = 0; e < kinds.size(); ++e)
      benchmark::DoNotOptimize(stiffness_matrix(kinds[e], 2, points[e], StiffnessModel::psd_projected));
  state.counters["time_per_element"] = benchmark::Counter(
      static_cast<double>(kinds.size()), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(projected_stiffness<Length>)->ArgName("noise")->Arg(2)->Arg(20);
BENCHMARK(projected_stiffness<TetrahedronVolume>)->ArgName("noise")->Arg(2)->Arg(20);
BENCHMARK(projected_stiffness<StableNeoHookean>)->ArgName("noise")->Arg(2)->Arg(20);
BENCHMARK(add_material_forces)
    ->ArgNames({"cells", "model"})
    ->Args({8, static_cast<int>(ElasticModel::springs_volumes)})
    ->Args({8, static_cast<int>(ElasticModel::springs_areas_volumes)})
    ->Args({8, static_cast<int>(ElasticModel::neo_hookean)});
BENCHMARK(add_forces<Length>)->Arg(4)->Arg(8)->Arg(17);
BENCHMARK(add_forces<TetrahedronVolume>)->Arg(4)->Arg(8)->Arg(17);

}  // namespace

BENCHMARK_MAIN();
