// A tuning fork of rubber, held at its stem, is struck: how long it rings is up to the step.
#include <memory>

#include "penalty/mesh/builders.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace fork {

// The prongs are the upper three quarters, three eighths of the width each; the stem is the lowest eighth.
constexpr Real height = 2, width = 0.5, depth = 0.1875, prong_height = 1.5, stem_height = 0.25;  // [m]
constexpr int cells_across = 8;                                                                  // the width
constexpr Material rubber{.young = 2e7, .poisson = 0.4, .density = 1000};
constexpr Real struck = 1.5;  // speed of the ends [m/s]

/// Some of the tetrahedra, with the vertices that these have.
TetMesh cut_from(const TetMesh& mesh, const std::vector<std::array<int, 4>>& tetrahedra) {
  std::vector<int> number(static_cast<std::size_t>(mesh.vertices.cols()), -1);
  for (const auto& tetrahedron : tetrahedra)
    for (const int v : tetrahedron) number[v] = 0;
  int count = 0;
  for (int& n : number)
    if (n == 0) n = count++;
  TetMesh kept;
  kept.vertices.resize(3, count);
  for (int v = 0; v < mesh.vertices.cols(); ++v)
    if (number[v] >= 0) kept.vertices.col(number[v]) = mesh.vertices.col(v);
  for (auto tetrahedron : tetrahedra) {
    for (int& v : tetrahedron) v = number[v];
    kept.tetrahedra.push_back(tetrahedron);
  }
  return kept;
}

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "fork");
  const int cells = 8 * (cells_in(options, 32, 8, 160) / 8);  // along the height
  const TetMesh block =
      make_box({width, height, depth}, {std::max(cells_across, cells / 4), cells, std::max(2, 3 * cells / 32)});
  std::vector<std::array<int, 4>> tetrahedra;
  for (const auto& tetrahedron : block.tetrahedra) {
    const Vector3 middle = block.vertices(Eigen::all, tetrahedron).rowwise().mean();
    const bool is_inside = std::abs(middle.x() - width / 2) < width / 8;
    const bool is_prong = middle.y() > height - prong_height, is_stem = middle.y() < stem_height;
    if (is_prong ? !is_inside : is_inside || !is_stem) tetrahedra.push_back(tetrahedron);
  }
  TetMesh mesh = cut_from(block, tetrahedra);
  mesh.vertex_sets = {{"stem", {}}, {"end", {}}};
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    if (mesh.vertices(1, v) < 1e-9) mesh.vertex_sets[0].members.push_back(v);
    if (mesh.vertices(1, v) > height - 1e-9 && mesh.vertices(0, v) < width / 2)
      mesh.vertex_sets[1].members.push_back(v);
  }
  return {mesh};
}

/// Of the mean place of one end, across.
class Ringing {
 public:
  explicit Ringing(Real rest) : rest_(rest) {}

  void see(Real time, Real place) {
    const Real away = place - rest_;
    if ((away < 0) != (last_ < 0)) {
      const Real crossing = last_time_ + (time - last_time_) * last_ / (last_ - away);
      if (num_crossings_++ == 0) first_crossing_ = crossing;
      last_crossing_ = crossing;
      if (num_crossings_ == 2) first_peak_ = peak_;
      last_peak_ = peak_;
      peak_ = 0;
    }
    peak_ = std::max(peak_, std::abs(away));
    last_ = away;
    last_time_ = time;
  }

  Real pitch() const {  // [Hz]
    return num_crossings_ < 2 ? 0 : (num_crossings_ - 1) / (last_crossing_ - first_crossing_) / 2;
  }
  Real kept() const { return first_peak_ > 0 ? last_peak_ / first_peak_ : 0; }  // of the first swing

 private:
  Real rest_, last_ = 0, last_time_ = 0, peak_ = 0, first_peak_ = 0, last_peak_ = 0, first_crossing_ = 0,
              last_crossing_ = 0;
  int num_crossings_ = 0;
};

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const TetMesh& mesh = body.solid();
  Elasticity elastic = elasticity(options, mesh, rubber, ElasticModel::neo_hookean);
  Eigen::Matrix3Xd velocities = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    const Real share = std::max<Real>(0, (mesh.vertices(1, v) - (height - prong_height)) / prong_height);
    velocities(0, v) = (mesh.vertices(0, v) < width / 2 ? -struck : struck) * share * share;
  }
  SceneSetup setup{
      .name = "fork",
      .title = "Tuning fork",
      .bodies = alone({.mesh = body,
                       .field = std::move(elastic.field),
                       .mass = elastic.mass,
                       .positions = start_positions(mesh.vertices, options.start.value_or(Start::rest), options.seed),
                       .velocities = velocities,
                       .pinned = mesh.vertex_set("stem")}),
      .step = step_options(options, {.integrator = Integrator::implicit_step, .implicit_order = 2}),
      .look = {.azimuth = 20, .elevation = 12}};
  const std::vector<int>& end = mesh.vertex_set("end");
  const auto ringing = std::make_shared<Ringing>(mesh.vertices(0, end).mean());
  setup.watch = [ringing, end](const SceneState& state) { ringing->see(state.time, state.x()(0, end).mean()); };
  setup.facts = [ringing](const SceneState&) -> std::vector<Fact> {
    return {{"pitch", ringing->pitch()}, {"amplitude_kept", ringing->kept()}};
  };
  return setup;
}

}  // namespace fork

const SceneEntry fork_scene{"fork", "a tuning fork rings: how long is up to the order of the implicit step", 5,
                            fork::body, fork::setup};

}  // namespace penalty::demo
