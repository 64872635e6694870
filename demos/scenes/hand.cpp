// Four fingers close around a soft ball, lift it by friction alone and hold it.
#include <algorithm>
#include <memory>

#include "scenes/scene_setup.h"

namespace penalty::demo {
namespace hand {

constexpr Material foam{.young = 1e5, .poisson = 0.35, .density = 200};
constexpr Real damping = 0.02;  // [s]
constexpr Real margin = 0.02;   // of contact [m]
constexpr int num_fingers = 4;
constexpr Real table_width = 1.2, table_height = 0.3;   // [m]
const Vector3 finger(0.12, 0.55, 0.3);                  // half extents, the first towards the ball [m]
constexpr Real open = 1.2, closed = 0.8;                // of a finger's face from the axis, of the body's radius
constexpr Real lift = 1.5;                              // [m]
constexpr Real grasped = 1, lifts = 1.2, lifted = 2.7;  // when the fingers are closed, go up, are up [s]

/// Finger k around a body of this radius that lies on the table.
Pose finger_pose(int k, Real radius, Real time) {
  const Matrix3 around = turned(45 + 360.0 * k / num_fingers, Vector3::UnitY());
  const Real face = radius * (open + (closed - open) * smooth_step(time / grasped));
  const Real height = table_height + radius + margin + lift * smooth_step((time - lifts) / (lifted - lifts));
  return {around, around * Vector3(face + finger.x(), height, 0)};
}

/// Vertices that touch fingers, followed in the frames of these from the moment when they go up.
class Grip {
 public:
  explicit Grip(std::vector<RigidObject> objects) : objects_(std::move(objects)) {}

  void see(const SceneState& state) {
    if (!touches_.empty() || state.time < lifts) return;
    height_ = state.x().row(1).mean();
    for (std::size_t k = 0; k < num_fingers; ++k)
      for (int i = 0; i < state.x().cols(); ++i)
        if (const Vector3 x = state.x().col(i).head<3>(); touches(k, state.objects[k], x))
          touches_.push_back({k, i, state.objects[k].local(x)});
  }

  std::vector<Fact> facts(const SceneState& state) const {
    Real sum = 0, most = 0;
    int held = 0;
    for (const auto& [k, i, place] : touches_) {
      const Vector3 x = state.x().col(i).head<3>();
      if (!touches(k, state.objects[k], x)) continue;
      const Real slip = (state.objects[k].local(x) - place).norm();
      sum += slip;
      most = std::max(most, slip);
      ++held;
    }
    return {{"touched_vertices", static_cast<double>(touches_.size())},
            {"held_vertices", static_cast<double>(held)},
            {"lifted", touches_.empty() ? 0 : state.x().row(1).mean() - height_},
            {"lift_of_fingers", lift},
            {"slip_mean", held > 0 ? sum / held : 0},
            {"slip_max", most}};
  }

 private:
  bool touches(std::size_t k, const Pose& pose, const Vector3& x) const {
    return depth(objects_[k], pose, x) > -1.1 * margin;
  }

  struct Touch {
    std::size_t finger;
    int vertex;
    Vector3 place;  // in the frame of the finger [m]
  };
  std::vector<RigidObject> objects_;
  std::vector<Touch> touches_;
  Real height_ = 0;
};

BodyMesh body(const SceneOptions& options) { return load_body(options, "ball"); }

SceneSetup setup(const SceneOptions& options, const BodyMesh& body) {
  const Eigen::Matrix3Xd drawn = body.drawn(body.vertices());
  const Real radius = drawn.row(0).maxCoeff();
  SceneSetup setup{.name = "hand",
                   .title = "Fingers lift a soft ball",
                   .gravity = {0, -9.81, 0},
                   .ground = true,
                   .step = step_options(options, {.damping_time = damping}),
                   .look = {.azimuth = 20, .elevation = 14}};
  for (int k = 0; k < num_fingers; ++k)
    setup.objects.push_back(
        {.shape = Block{finger}, .path = [k, radius](Real time) { return finger_pose(k, radius, time); }});
  setup.objects.push_back({.shape = Block{Vector3(table_width, table_height, table_width) / 2},
                           .pose = {.position = {0, table_height / 2, 0}},
                           .scenery = true});
  const Real height = table_height + margin - drawn.row(1).minCoeff();
  setup.bodies.push_back(soft_object(options, body, foam, {.position = {0, height, 0}}));
  const auto grip = std::make_shared<Grip>(setup.objects);
  setup.watch = [grip](const SceneState& state) { grip->see(state); };
  setup.facts = [grip](const SceneState& state) { return grip->facts(state); };
  return setup;
}

}  // namespace hand

const SceneEntry hand_scene{"hand", "fingers close around a soft ball, lift it and hold it", 4.5, hand::body,
                            hand::setup};

}  // namespace penalty::demo
