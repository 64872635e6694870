// Every scene in both worlds, briefly, held to the laws it has to obey. Compiled for both precisions of Bullet.
#include "scenes/scene.h"

#include <gtest/gtest.h>

#include <memory>

#include "scenes/shape_measure.h"

namespace penalty::demo {
namespace {

class Scenes : public testing::TestWithParam<WorldKind> {
 protected:
  std::unique_ptr<Scene> make(std::string_view name, const SceneOptions& options) const {
    const SceneEntry& entry = find_scene(name);
    return std::make_unique<Scene>(entry.setup(options, entry.body(options)), GetParam());
  }
  static constexpr Real dt = 1.0 / 64;
  static constexpr Real margin = 0.02;  // of the soft body: contact begins so far from the rigid surfaces [m]
};

std::string world_name(const testing::TestParamInfo<WorldKind>& info) { return std::string(name_of(info.param)); }

INSTANTIATE_TEST_SUITE_P(Worlds, Scenes, testing::Values(WorldKind::classic, WorldKind::deformable), world_name);

ShapeErrors errors(const Scene& scene) {
  const TetMesh& mesh = scene.setup().body.mesh;
  return ShapeMeasure(mesh.vertices, mesh.tetrahedra).errors(scene.particles().positions);
}

TEST_P(Scenes, FlightKeepsMomentaAndEnergy) {
  const auto scene = make("flight", {.mesh = "torus", .cells = 10});
  ASSERT_TRUE(scene->is_free());
  const Momenta before = scene->momenta();
  const Real energy = scene->energies().total();
  ASSERT_GT(before.linear.norm(), 0.01);
  ASSERT_GT(before.angular.norm(), 0.1);
  ASSERT_GT(scene->energies().elastic, 1e-3);
  for (int step = 0; step < 128; ++step) scene->step(dt);
  ASSERT_TRUE(scene->report().finite);
  const Real bound = bullet_precision() == "float32" ? 1e-6 : 1e-12;
  EXPECT_LT((scene->momenta().linear - before.linear).norm(), bound * before.linear_scale);
  EXPECT_LT((scene->momenta().angular - before.angular).norm(), bound * before.angular_scale);
  EXPECT_NEAR(scene->energies().total(), energy, 0.05 * energy);
  EXPECT_EQ(errors(*scene).inverted, 0);
}

TEST_P(Scenes, DropFallsFreelyAndThenLiesOnTheGround) {
  const auto scene = make("drop", {.mesh = "ball", .cells = 8, .stiffness = 10, .spheres = 5});
  const Real middle = scene->particles().positions.row(1).mean();
  int step = 0;
  for (; step < 16; ++step) scene->step(dt);
  const Real time = step * dt;
  EXPECT_NEAR(scene->particles().positions.row(1).mean(), middle - 9.81 / 2 * time * time, 1e-3);
  EXPECT_EQ(scene->penetration(), 0);

  Real least = scene->energies().total(), gain = 0, deepest = 0;
  for (; step < 4 * 64; ++step) {
    const Real before = scene->energies().total();
    scene->step(dt);
    ASSERT_TRUE(scene->report().finite) << "step " << step;
    gain = std::max(gain, scene->energies().total() - before);
    deepest = std::max(deepest, scene->penetration());
    least = std::min(least, scene->energies().total());
  }
  EXPECT_LT(gain, 0.01);
  EXPECT_LT(deepest, margin);
  EXPECT_LT(scene->energies().kinetic, 0.1);
  EXPECT_LT(scene->energies().total(), least + 0.01);
  EXPECT_LT(scene->particles().positions.row(1).minCoeff(), 0.6);  // on the ground or on balls of at most 0.64 m
  EXPECT_EQ(errors(*scene).inverted, 0);
}

TEST_P(Scenes, DropCarriesAnEmbeddedSurface) {
  SceneOptions options{.cells = 8};
  ASSERT_TRUE(std::filesystem::exists(bunny_path())) << "package glmark2-data is not installed";
  const auto scene = make("drop", options);
  ASSERT_TRUE(scene->setup().body.surface);
  Real deepest = 0;
  for (int step = 0; step < 96; ++step) {
    scene->step(dt);
    deepest = std::max(deepest, scene->penetration());
  }
  ASSERT_TRUE(scene->report().finite);
  EXPECT_LT(deepest, margin);
  const Eigen::Matrix3Xd surface = scene->setup().body.drawn(scene->particles().positions.topRows<3>());
  EXPECT_LT(surface.row(1).minCoeff(), 0.2);  // it has landed
  EXPECT_LT(scene->particles().positions.row(1).minCoeff(),
            surface.row(1).minCoeff());  // the lattice reaches beyond it
}

TEST_P(Scenes, BeamHangsFromItsClampedFace) {
  const auto scene = make("beam", {.cells = 16});
  EXPECT_FALSE(scene->is_free());
  for (int step = 0; step < 32; ++step) scene->step(dt);
  for (int i : scene->setup().pinned)
    EXPECT_LT((scene->particles().positions.col(i).head<3>() - scene->setup().positions.col(i)).norm(), 1e-12);
  EXPECT_GT(scene->tip_drop(), 0.4);  // it swings beyond its rest, 0.27 m below the start
  EXPECT_EQ(errors(*scene).inverted, 0);
}

TEST_P(Scenes, ASquashedBodyFindsItsShapeAgain) {
  const auto scene = make("flight", {.mesh = "box", .cells = 4, .stiffness = 1, .start = Start::squash});
  const TetMesh& mesh = scene->setup().body.mesh;
  const ShapeMeasure measure(mesh.vertices, mesh.tetrahedra);
  ASSERT_GT(measure.rest_error(scene->particles().positions), 0.1);
  for (int step = 0; step < 256; ++step) scene->step(dt);
  EXPECT_LT(measure.rest_error(scene->particles().positions), 1e-2);
}

}  // namespace
}  // namespace penalty::demo
