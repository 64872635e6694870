// Every scene in both worlds, briefly, held to the laws it has to obey. Compiled for both precisions of Bullet.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"
#include "scene_fixture.h"

namespace penalty::demo {
namespace {

INSTANTIATE_TEST_SUITE_P(Worlds, Scenes, testing::Values(WorldKind::classic, WorldKind::deformable), world_name);

ShapeErrors errors(const Scene& scene) {
  const BodyMesh& body = scene.setup().bodies[0].mesh;
  return ShapeMeasure(body.vertices(), body.edges(), body.tetrahedra()).errors(scene.particles().positions);
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
  for (; step < 12 * 64; ++step) {
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
  ASSERT_TRUE(scene->setup().bodies[0].mesh.surface);
  Real deepest = 0;
  for (int step = 0; step < 96; ++step) {
    scene->step(dt);
    deepest = std::max(deepest, scene->penetration());
  }
  ASSERT_TRUE(scene->report().finite);
  EXPECT_LT(deepest, margin);
  const Eigen::Matrix3Xd surface = scene->setup().bodies[0].mesh.drawn(scene->particles().positions.topRows<3>());
  EXPECT_LT(surface.row(1).minCoeff(), 0.2);  // it has landed
  EXPECT_LT(scene->particles().positions.row(1).minCoeff(),
            surface.row(1).minCoeff());  // the lattice reaches beyond it
}

TEST_P(Scenes, DropMakesClothOfAnOpenSheetAndFillsSurfacesWithHoles) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("penalty-drop-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const auto write = [&folder](const char* name, const Eigen::Matrix3Xd& vertices,
                               const std::vector<Triangle>& triangles) {
    std::ofstream file(folder / name);
    for (Eigen::Index v = 0; v < vertices.cols(); ++v) file << "v " << vertices.col(v).transpose() << '\n';
    for (const Triangle& t : triangles) file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    return (folder / name).string();
  };
  const TriangleSurface sheet = make_sheet(1, 1, 12, 12);
  const TetMesh box = make_box({1, 1, 1}, {1, 1, 1});
  std::vector<Triangle> pierced = boundary_faces(box.tetrahedra);
  pierced.pop_back();
  for (const std::string& file :
       {write("sheet.obj", sheet.vertices, sheet.triangles), write("box.obj", box.vertices, pierced)}) {
    SCOPED_TRACE(file);
    const bool is_sheet = file.ends_with("sheet.obj");
    const auto scene = make("drop", {.mesh = file, .cells = 6});
    const BodyMesh& body = scene->setup().bodies[0].mesh;
    EXPECT_EQ(body.is_shell(), is_sheet);
    EXPECT_EQ(body.repairs(), is_sheet ? "" : "3 open and 0 branching edges: filled by the winding number");
    Real deepest = 0, lowest = 2;
    for (int step = 0; step < 96; ++step) {
      scene->step(dt);
      deepest = std::max(deepest, scene->penetration());
      lowest = std::min(lowest, body.drawn(scene->particles().positions.topRows<3>()).row(1).minCoeff());
    }
    ASSERT_TRUE(scene->report().finite);
    EXPECT_LT(deepest, margin);
    EXPECT_LT(lowest, 0.2) << "it lands";
    EXPECT_GT(lowest, 0);
  }
  std::filesystem::remove_all(folder);
}

TEST_P(Scenes, BeamHangsFromItsClampedFace) {
  const auto scene = make("beam", {.cells = 16});
  EXPECT_FALSE(scene->is_free());
  for (int step = 0; step < 32; ++step) scene->step(dt);
  for (int i : scene->setup().bodies[0].pinned)
    EXPECT_LT((scene->particles().positions.col(i).head<3>() - scene->setup().bodies[0].positions.col(i)).norm(),
              1e-12);
  EXPECT_GT(scene->tip_drop().value_or(0), 0.4);  // it swings beyond its rest, 0.27 m below the start
  EXPECT_EQ(errors(*scene).inverted, 0);
}

TEST_P(Scenes, ASquashedBodyFindsItsShapeAgain) {
  const auto scene = make("flight", {.mesh = "box", .cells = 4, .stiffness = 1, .start = Start::squash});
  const TetMesh& mesh = scene->setup().bodies[0].mesh.solid();
  const ShapeMeasure measure(mesh.vertices, mesh.tetrahedra);
  ASSERT_GT(measure.rest_error(scene->particles().positions), 0.1);
  for (int step = 0; step < 256; ++step) scene->step(dt);
  EXPECT_LT(measure.rest_error(scene->particles().positions), 1e-2);
}

TEST_P(Scenes, ClothStartsUnstrainedAndCatchesTheBall) {
  const auto scene = make("cloth", {.cells = 24});
  const Real rounding = bullet_precision() == "float32" ? 1e-6 : 1e-12;  // of the positions that Bullet is given
  EXPECT_LT(errors(*scene).length_max, rounding);
  const std::vector<LedgerEntry> ledger = scene->ledger();
  ASSERT_EQ(ledger.size(), 2u);
  EXPECT_EQ(ledger[0].name, "length");
  EXPECT_LT(ledger[0].energy, 1e4 * rounding * rounding) << "pleated, not stretched";
  EXPECT_FALSE(scene->tip_drop());
  Real gain = 0, deepest = 0;
  for (int step = 0; step < 3 * 64; ++step) {
    const Real before = scene->energies().total();
    scene->step(dt);
    ASSERT_TRUE(scene->report().finite) << "step " << step;
    gain = std::max(gain, scene->energies().total() - before);
    deepest = std::max(deepest, scene->penetration());
  }
  EXPECT_LT(gain, 0.02);
  EXPECT_LT(deepest, margin);
  for (int i : scene->setup().bodies[0].pinned)
    EXPECT_LT((scene->particles().positions.col(i).head<3>() - scene->setup().bodies[0].positions.col(i)).norm(),
              rounding);
  const Vector3 ball = scene->objects().front().position;
  EXPECT_GT(ball.y(), 0.3) << "held above the ground, where its middle would be at 0.25 m";
  EXPECT_LT(ball.y(), 1.25) << "and no longer on its way";
  EXPECT_LT(errors(*scene).length_mean, 0.03);
  EXPECT_TRUE(std::isnan(errors(*scene).volume_mean)) << "there is none";
  EXPECT_EQ(errors(*scene).inverted, 0);
  ASSERT_EQ(scene->facts().size(), 1u);
  EXPECT_NEAR(scene->facts().front().value, 1 - scene->particles().positions.row(1).minCoeff(), 1e-15);
}

TEST_P(Scenes, AFinerClothIsAsStiff) {
  // Stretched alike, they hold the same energy: K follows the area that an edge stands for. Edges at the rim stand for
  // half as much: 1/cells of the sheet is not quite as isotropic as the rest.
  std::vector<Real> energies;
  for (const int cells : {8, 32}) {
    const auto scene = make("cloth", {.cells = cells});
    const Eigen::Matrix3Xd rest = scene->setup().bodies[0].mesh.vertices();
    energies.push_back(scene->field().energy(pack(Vector3(1.02, 1, 1.01).asDiagonal() * rest)));
  }
  ASSERT_GT(energies[0], 0.1);
  EXPECT_NEAR(energies[1], energies[0], 0.05 * energies[0]);
}

TEST_P(Scenes, ABentClothHoldsTheEnergyOfAPlate) {
  // Rolled to a cylinder of radius R: D / 2 R² per area, D = E h³ / 12 (1 - 1/9) = 7.5e-5 N m. One row of cells at the
  // rim has no hinge: an energy short by 1/cells.
  constexpr Real radius = 1, area = 4, plate = 8e5 * 1e-9 * 3 / 32 / (2 * radius * radius) * area;
  for (const int cells : {10, 40}) {
    const auto scene = make("cloth", {.cells = cells});
    Eigen::Matrix3Xd rolled = scene->setup().bodies[0].mesh.vertices();
    for (int i = 0; i < rolled.cols(); ++i) {
      const Real angle = rolled(0, i) / radius;
      rolled(0, i) = radius * std::sin(angle);
      rolled(1, i) += radius * std::cos(angle);
    }
    const ElementBatch& hinges = *scene->field().find("bending angle");
    EXPECT_NEAR(hinges.energy(pack(rolled)), plate * (1 - 1.0 / cells), 0.01 * plate) << cells;
  }
}

/// A box of jelly between a path-driven press and a free block: what SceneSetup offers besides balls.
SceneSetup press(const Vector3& press_start) {
  BodyMesh body{make_box({0.4, 0.4, 0.4}, {2, 2, 2})};
  SceneSetup setup{.name = "press",
                   .title = "Press",
                   .bodies = alone({.mesh = body,
                                    .field = make_elastic_field(body.vertices(), body.solid().tetrahedra, 10.0),
                                    .positions = body.vertices()}),
                   .gravity = {0, -9.81, 0},
                   .ground = true,
                   .step = {.damping_time = 0.01}};
  setup.bodies[0].positions.row(1).array() += 0.02;
  setup.objects.push_back({.shape = Block{{0.4, 0.05, 0.4}}, .path = [press_start](Real time) {
                             return Pose{.position = press_start - Vector3(0, 0.1 * std::min(time, 1.0), 0)};
                           }});
  setup.objects.push_back({.shape = Block{{0.1, 0.2, 0.3}}, .pose = {.position = {3, 1, 0}}, .mass = 2});
  return setup;
}

TEST_P(Scenes, ABlockFollowsItsPathAndPresses) {
  Scene scene(press({0.2, 0.49, 0.2}), GetParam());
  EXPECT_FALSE(scene.is_free());
  EXPECT_NEAR((scene.objects()[0].position - Vector3(0.2, 0.49, 0.2)).norm(), 0, 1e-6);
  for (int step = 0; step < 128; ++step) scene.step(dt);
  EXPECT_NEAR(scene.time(), 2, 1e-12);
  EXPECT_NEAR(scene.objects()[0].position.y(), 0.39, 1e-6);
  const Real top = scene.particles().positions.row(1).maxCoeff();
  EXPECT_LT(top, 0.34 + 1e-3) << "under the press, 0.05 m below its middle";
  EXPECT_GT(top, 0.30);
  EXPECT_LT(scene.penetration(), margin);
  EXPECT_NEAR(scene.objects()[1].position.y(), 0.2, 0.05) << "the free block has fallen on its face";
  // 2 kg at rest, 1 kg of jelly: the block's energy is that of its height.
  EXPECT_NEAR(scene.energies().rigid_kinetic, 0, 1e-2);
}

TEST_P(Scenes, SeveralBodiesAddUp) {
  SceneSetup setup = press({0.2, 2, 0.2});
  const BodyMesh mesh = setup.bodies[0].mesh;
  SoftObject thrown{.mesh = mesh,
                    .field = make_elastic_field(mesh.vertices(), mesh.solid().tetrahedra, 20.0),
                    .mass = 2,
                    .positions = (1.1 * mesh.vertices()).colwise() + Vector3(1, 1, 0),
                    .velocities = Vector3(3, 0, 0).replicate(1, mesh.vertices().cols())};
  setup.bodies.push_back(std::move(thrown));
  Scene scene(std::move(setup), GetParam());
  const Energies energies = scene.energies();
  EXPECT_LT(scene.field(0).energy(scene.particles(0).positions), 1e-9);
  EXPECT_NEAR(energies.elastic, scene.field(1).energy(scene.particles(1).positions), 1e-9);
  ASSERT_GT(energies.elastic, 1e-3);
  EXPECT_NEAR(energies.kinetic, 9, 1e-5) << "2 kg at 3 m/s";
  EXPECT_NEAR(energies.gravitational, 9.81 * (0.22 + 2 * 1.22 + 2 * 1), 1e-4) << "and 2 kg of a block, 1 m high";
  EXPECT_NEAR((scene.momenta().linear - Vector3(6, 0, 0)).norm(), 0, 1e-5);
  const std::vector<LedgerEntry> ledger = scene.ledger();
  ASSERT_EQ(ledger.size(), 4u);
  EXPECT_EQ(ledger[0].name, ledger[2].name);
  EXPECT_GT(ledger[2].energy, 1e3 * ledger[0].energy);
  for (int step = 0; step < 16; ++step) scene.step(dt);
  EXPECT_TRUE(scene.report().finite);
  EXPECT_EQ(scene.report().substeps, std::max(scene.report(0).substeps, scene.report(1).substeps));
  const SceneState state = scene.state();
  EXPECT_NEAR(state.x(1).row(0).mean(), 1.22 + 3 * 16 * dt, 1e-3);
  EXPECT_NEAR(state.x(0).row(0).mean(), 0.2, 1e-3);
  EXPECT_EQ(state.objects.size(), 2u);
}

TEST_P(Scenes, ControlSeesTheFieldBeforeEachStep) {
  SceneSetup setup = press({0.2, 2, 0.2});
  std::vector<Real> times;
  std::size_t elements = 0;
  setup.bodies[0].control = [&](PotentialField& field, Real time) {
    times.push_back(time);
    elements = field.num_elements();
  };
  Scene scene(std::move(setup), GetParam());
  for (int step = 0; step < 4; ++step) scene.step(dt);
  EXPECT_EQ(times, (std::vector<Real>{0, dt, 2 * dt, 3 * dt}));
  EXPECT_EQ(elements, scene.field().num_elements());
  EXPECT_GT(elements, 0u);
}

}  // namespace
}  // namespace penalty::demo
