// Nanoseconds an element for one evaluation of the forces; the argument is the number of cells across the beam.
#include <benchmark/benchmark.h>

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
  for (auto _ : state) benchmark::DoNotOptimize(batch.add_forces(x, f));
  state.counters["time_per_element"] =
      benchmark::Counter(static_cast<double>(batch.num_elements()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

// All the elements of a material, a tetrahedron.
void add_material_forces(benchmark::State& state) {
  const TetMesh mesh = make_beam(static_cast<int>(state.range(0)));
  const PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e6, .poisson = 0.4},
                                                  static_cast<ElasticModel>(state.range(1)));
  PackedVectors x = field.rest_positions(), f = PackedVectors::Zero(4, x.cols());
  x.topRows<3>() *= 1.01;
  for (auto _ : state) benchmark::DoNotOptimize(field.add_forces(x, f));
  state.counters["time_per_tetrahedron"] =
      benchmark::Counter(static_cast<double>(mesh.tetrahedra.size()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(add_material_forces)
    ->ArgNames({"cells", "model"})
    ->Args({8, static_cast<int>(ElasticModel::springs_volumes)})
    ->Args({8, static_cast<int>(ElasticModel::springs_areas_volumes)})
    ->Args({8, static_cast<int>(ElasticModel::neo_hookean)});
BENCHMARK(add_forces<Length>)->Arg(4)->Arg(8)->Arg(17);
BENCHMARK(add_forces<TetrahedronVolume>)->Arg(4)->Arg(8)->Arg(17);

}  // namespace

BENCHMARK_MAIN();
