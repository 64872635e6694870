// Two boards of the same two materials, 2 x 0.2 x 0.5 m each, held at one end: what lies next to the wall decides.
#include "penalty/mesh/builders.h"
#include "penalty/mesh/regions.h"
#include "scenes/scene_setup.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace materials {

constexpr Real length = 2, thickness = 0.2, width = 0.5, apart = 0.4;  // [m]
constexpr Material rubber{.young = 1e7, .poisson = 0.4, .density = 1000};
constexpr Material hard{.young = 15e7, .poisson = 0.4, .density = 1000};

BodyMesh body(const SceneOptions& options) {
  refuse_mesh(options, "materials");
  refuse_model(options, "materials");
  const int cells = cells_in(options, 32, 8, 200);  // along the board
  TetMesh mesh =
      make_box({length, thickness, width}, {2 * (cells / 2), std::max(2, cells / 8), std::max(2, cells / 5)});
  mesh.regions = {{"next to the wall", {}}, {"free half", {}}};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Real x = mesh.vertices(0, mesh.tetrahedra[t]).mean();
    mesh.regions[x < length / 2 ? 0 : 1].members.push_back(static_cast<int>(t));
  }
  mesh.vertex_sets = {{"wall", {}}, {"tip", {}}};
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    if (mesh.vertices(0, v) < 1e-9) mesh.vertex_sets[0].members.push_back(v);
    if (mesh.vertices(0, v) > length - 1e-9) mesh.vertex_sets[1].members.push_back(v);
  }
  return {mesh};
}

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const TetMesh& mesh = body.solid();
  const auto add = [&](SceneSetup& setup, const Material& wall, const Material& free, Real z) {
    const Materials both = materials_of(mesh, {{"next to the wall", wall}, {"free half", free}});
    const Eigen::Matrix3Xd start = start_positions(mesh.vertices, options.start.value_or(Start::rest), options.seed);
    SoftObject board{.mesh = body,
                     .field = make_elastic_field(mesh.vertices, mesh.tetrahedra, both, ElasticModel::neo_hookean),
                     .mass = rubber.density * volume(mesh),
                     .positions = start.colwise() + Vector3(0, 0, z),
                     .pinned = mesh.vertex_set("wall"),
                     .tip = mesh.vertex_set("tip")};
    for (const int v : board.pinned) board.positions.col(v) = mesh.vertices.col(v) + Vector3(0, 0, z);
    setup.bodies.push_back(std::move(board));
  };
  SceneSetup setup{.name = "materials",
                   .title = "Two materials",
                   .gravity = {0, -9.81, 0},
                   .step = step_options(options, {.drag = 4}),
                   .look = {.azimuth = 24, .elevation = 20}};
  add(setup, rubber, hard, width + apart);
  add(setup, hard, rubber, 0);
  setup.facts = [tip = mesh.vertex_set("tip")](const SceneState& state) -> std::vector<Fact> {
    const auto sag = [&](std::size_t k) { return thickness / 2 - state.x(k)(1, tip).mean(); };
    return {{"sag_of_the_soft_root", sag(0)}, {"sag_of_the_hard_root", sag(1)}};
  };
  return setup;
}

}  // namespace materials

const SceneEntry materials_scene{"materials",
                                 "two boards, each half of rubber and half of something harder, held at one end", 3,
                                 materials::body, materials::setup};

}  // namespace penalty::demo
