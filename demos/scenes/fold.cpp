// A cloth falls, folded, on a ball and from there on the floor: it lies on itself in layers.
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "penalty/contact/box_tree.h"
#include "penalty/contact/closest_points.h"
#include "penalty/mesh/surface_builders.h"
#include "scenes/scene_setup.h"
#include "scenes/shell.h"
#include "scenes/start_shapes.h"

namespace penalty::demo {
namespace {

constexpr Real width = 1, length = 1.4;  // [m]
constexpr Sheet woven{.young = 2e5, .thickness = 1e-3, .density = 300, .bending = 0.3};
constexpr Real damping = 0.005;                      // [s]
constexpr Real ball_radius = 0.2, clearance = 0.12;  // between ball and cloth [m]
constexpr Real fold_radius = 0.04, wave = 0.02;      // of the fold at the top, of the waves of both layers [m]
constexpr Real kept_share = 0.3, margin = 0.02;      // of the mean edge, at most: what layers keep [m]

BodyMesh fold_body(const SceneOptions& options) {
  refuse_mesh(options, "fold");
  refuse_model(options, "fold");
  const int cells = cells_in(options, 38, 4, 200);
  return {make_sheet(width, length, cells, static_cast<int>(std::lround(cells * length / width)))};
}

/// Up on one side, over a half circle, and down on the other: every edge has nearly its rest length.
Eigen::Matrix3Xd folded_over(const Eigen::Matrix3Xd& flat) {
  const Real arc = std::numbers::pi * fold_radius, side = (length - arc) / 2, bottom = 2 * ball_radius + clearance;
  Eigen::Matrix3Xd x(3, flat.cols());
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const Real s = flat(1, i), along = flat(0, i) - width / 2;
    const Real over = std::clamp((s - side) / fold_radius, Real(0), std::numbers::pi);
    const Real down = std::max<Real>(s - side - arc, 0);
    x.col(i) << along, bottom + std::min(s, side) + fold_radius * std::sin(over) - down,
        -fold_radius * std::cos(over) + wave * std::sin(7 * along + 3 * s);
  }
  return x;
}

/// What the claim of the scene is measured by.
class Layers {
 public:
  explicit Layers(const TriangleSurface& sheet) : sheet_(sheet), edges_(edges_of(std::span(sheet.triangles))) {
    Real sum = 0;
    for (const auto& [i, j] : edges_) sum += (sheet.vertices.col(i) - sheet.vertices.col(j)).norm();
    kept_ = std::min(margin, kept_share * sum / static_cast<Real>(edges_.size()));
    const PackedVectors start = pack(sheet.vertices);
    std::vector<Box> boxes;
    boxes.reserve(sheet.triangles.size());
    for (const Triangle& t : sheet.triangles) boxes.push_back(box_of(start, t));
    tree_ = BoxTree(boxes);
  }

  void see(const Positions& x) {
    tree_.refit([&](int t) { return box_of(x, sheet_.triangles[t]); });
    const auto at = [&](int i) { return Vector3(x.col(i).head<3>()); };
    for (const Edge& edge : edges_)
      tree_.visit(box_of(x, edge), 0, [&](int k) {
        const auto& [a, b, c] = sheet_.triangles[k];
        for (const int i : edge)
          if (i == a || i == b || i == c) return;
        crossings_ += pierces(at(edge[0]), at(edge[1]), at(a), at(b), at(c));
      });
    for (int i = 0; i < x.cols(); ++i) {
      Box box;
      box.add(at(i));
      tree_.visit(box, kept_, [&](int k) {
        const auto& [a, b, c] = sheet_.triangles[k];
        if (i == a || i == b || i == c) return;
        least_ = std::min(least_, closest_points_of_triangle(at(i), at(a), at(b), at(c)).difference.norm());
      });
    }
  }

  std::vector<Fact> facts() const {
    return {{"self_crossings", static_cast<Real>(crossings_)},
            {"kept_distance", kept_},
            {"least_distance", std::min(least_, kept_)}};
  }

 private:
  static Box box_of(const Positions& x, std::span<const int> corners) {
    Box box;
    for (const int i : corners) box.add(x.col(i).head<3>());
    return box;
  }
  static bool pierces(const Vector3& p, const Vector3& q, const Vector3& a, const Vector3& b, const Vector3& c) {
    const auto volume = [](const Vector3& u, const Vector3& v, const Vector3& w) { return u.cross(v).dot(w); };
    const Real from = volume(b - a, c - a, p - a), to = volume(b - a, c - a, q - a);
    if (!(from * to < 0)) return false;
    const Vector3 d = q - p;
    const Real u = volume(d, a - p, b - p), v = volume(d, b - p, c - p), w = volume(d, c - p, a - p);
    return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
  }

  TriangleSurface sheet_;
  std::vector<Edge> edges_;
  BoxTree tree_;
  Real kept_ = 0, least_ = std::numeric_limits<Real>::infinity();
  long crossings_ = 0;
};

SceneSetup fold(const SceneOptions& options, const BodyMesh& body) {
  if (options.poisson) throw std::invalid_argument("--poisson does not apply to fold: springs in a plane have 1/3");
  const Eigen::Matrix3Xd& rest = body.vertices();
  Sheet sheet = woven;
  if (options.young) sheet.young = *options.young;
  PotentialField field = options.stiffness ? PotentialField(rest) : shell_field(body.shell(), sheet);
  if (options.stiffness) field.add<Length>(body.edges(), *options.stiffness);
  const Start start = options.start.value_or(Start::rest);
  const Eigen::Matrix3Xd folded = folded_over(rest);
  const auto layers = std::make_shared<Layers>(body.shell());
  return {.name = "fold",
          .title = "Cloth falls folded on a ball",
          .bodies = alone({.mesh = body,
                           .field = std::move(field),
                           .mass = options.stiffness ? 1 : sheet.density * sheet.thickness * area(body.shell()),
                           .positions = start == Start::rest ? folded : start_positions(folded, start, options.seed)}),
          .gravity = {0, -9.81, 0},
          .ground = true,
          .objects = {{.shape = Ball{ball_radius}, .pose = {.position = {0.05, ball_radius, 0.02}}}},
          .step = step_options(options, {.damping_time = damping, .drag = 0.3}),
          .look = {.azimuth = 32, .elevation = 18, .wire = false},
          .watch = [layers](const SceneState& state) { layers->see(state.x()); },
          .facts = [layers](const SceneState&) { return layers->facts(); }};
}

}  // namespace

const SceneEntry fold_scene{"fold", "a cloth falls folded on a ball and lies on itself", 3, fold_body, fold};

}  // namespace penalty::demo
