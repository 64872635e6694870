// What each scene about contact claims, in both worlds, coarse. Compiled for both precisions of Bullet.
#include <cmath>
#include <numbers>

#include "scene_fixture.h"

namespace penalty::demo {
namespace {

using ContactClaims = Scenes;

INSTANTIATE_TEST_SUITE_P(Worlds, ContactClaims, testing::Values(WorldKind::classic, WorldKind::deformable), world_name);

void run(Scene& scene, Real duration) {
  for (int step = 0; step < std::lround(60 * duration); ++step) scene.step(1.0 / 60);
  ASSERT_TRUE(scene.report().finite);
}

TEST_P(ContactClaims, RingsThatCollideKeepTheirMomenta) {
  const auto scene = make("collide", {.cells = 10});
  ASSERT_TRUE(scene->is_free());
  const Momenta before = scene->momenta();
  const Real energy = scene->energies().total();
  for (int step = 0; step < 60; ++step) {
    scene->step(1.0 / 60);
    ASSERT_LE(scene->energies().total(), (1 + 1e-12) * energy) << "step " << step;
  }
  EXPECT_GT(fact(*scene, "exchanged_momentum"), 0.2) << "they have met";
  EXPECT_EQ(fact(*scene, "crossings"), 0);
  const Real bound = bullet_precision() == "float32" ? 1e-6 : 1e-12;
  EXPECT_LT((scene->momenta().linear - before.linear).norm(), bound * before.linear_scale);
  EXPECT_LT((scene->momenta().angular - before.angular).norm(), bound * before.angular_scale);
}

TEST_P(ContactClaims, ThePileStandsAndComesToRest) {
  const auto scene = make("stack", {.cells = 3});
  run(*scene, 4);
  EXPECT_EQ(fact(*scene, "crossings"), 0);
  EXPECT_EQ(fact(*scene, "in_order"), 1);
  EXPECT_LT(fact(*scene, "lean"), 0.05);
  EXPECT_LT(fact(*scene, "residual_speed"), 0.01);
  EXPECT_LT(scene->penetration(), margin);
  EXPECT_GT(fact(*scene, "pile_height"), 0.85 * (3 * 0.6 + 2 * 0.2));
}

TEST_P(ContactClaims, NothingInTheBowlIsInsideAnythingElse) {
  const auto scene = make("bowl", {});
  run(*scene, 2.5);
  EXPECT_GE(fact(*scene, "soft_bodies"), 10);
  Real highest = 0;
  for (std::size_t b = 0; b < scene->setup().bodies.size(); ++b)
    highest = std::max(highest, scene->particles(b).positions.row(1).mean());
  EXPECT_LT(highest, 5) << "all have fallen";
  EXPECT_EQ(fact(*scene, "crossings"), 0);
  EXPECT_EQ(fact(*scene, "overlapping_pairs"), 0);
  EXPECT_EQ(fact(*scene, "escaped"), 0);
}

TEST_P(ContactClaims, AClothThatFallsFoldedLiesOnItselfInLayers) {
  const auto scene = make("fold", {.cells = 12});
  run(*scene, 2);
  const Real kept = fact(*scene, "kept_distance"), least = fact(*scene, "least_distance");
  EXPECT_EQ(fact(*scene, "self_crossings"), 0) << "in no frame";
  EXPECT_GT(least, 0.5 * kept);
  EXPECT_LT(least, kept) << "layers do touch";
  EXPECT_EQ(scene->penetration(), 0) << "into ball or floor";
  EXPECT_LT(scene->particles().positions.row(1).minCoeff(), 2 * margin) << "some lies on the floor";
}

TEST_P(ContactClaims, FrictionHoldsOneRingAndLetsTheOtherSlide) {
  const auto scene = make("incline", {.cells = 14});
  run(*scene, 2.4);
  EXPECT_GT(fact(*scene, "slid"), 2);
  EXPECT_LT(std::abs(fact(*scene, "creep")), 2e-3);
  const Real slope = std::numbers::pi / 9;
  EXPECT_NEAR(fact(*scene, "acceleration"), 9.81 * (std::sin(slope) - 0.2 * std::cos(slope)), 0.02);
}

TEST_P(ContactClaims, ThePressedRingHasItsShapeAgain) {
  const auto scene = make("press", {.cells = 14});
  const BodyMesh& mesh = scene->setup().bodies[0].mesh;
  const ShapeMeasure measure(mesh.vertices(), mesh.tetrahedra());
  Real largest = 0, deepest = 0;
  for (int step = 0; step < 5 * 60; ++step) {
    scene->step(1.0 / 60);
    largest = std::max(largest, measure.rest_error(scene->particles().positions));
    deepest = std::max(deepest, scene->penetration());
  }
  EXPECT_GT(largest, 0.05) << "it was flat";
  EXPECT_LT(fact(*scene, "least_height"), 0.6 * fact(*scene, "rest_height"));
  EXPECT_LT(measure.rest_error(scene->particles().positions), 0.01);
  EXPECT_EQ(fact(*scene, "self_crossings"), 0);
  EXPECT_EQ(deepest, 0) << "the margin keeps it off slab and ground";
}

TEST_P(ContactClaims, BallsBounceHigherTheMoreRestitutionTheyHave) {
  const auto scene = make("bounce", {.cells = 8});
  const Real energy = scene->energies().total();
  for (int step = 0; step < 2 * 60; ++step) {
    scene->step(1.0 / 60);
    ASSERT_LE(scene->energies().total(), (1 + 1e-3) * energy) << "step " << step;
  }
  const Real own = fact(*scene, "rebound_of_0"), half = fact(*scene, "rebound_of_0.5"),
             most = fact(*scene, "rebound_of_0.9");
  EXPECT_LT(own, 0.85);
  EXPECT_GT(half, own + 0.02);
  EXPECT_GT(most, half + 0.05);
  EXPECT_GT(most, 0.8);
  EXPECT_LT(most, 1);
}

TEST_P(ContactClaims, FingersLiftTheBallWithoutSlip) {
  const auto scene = make("hand", {.cells = 10});
  run(*scene, 4.5);
  EXPECT_NEAR(fact(*scene, "lifted"), fact(*scene, "lift_of_fingers"), 0.1) << "it hangs a little lower";
  EXPECT_GT(fact(*scene, "held_vertices"), 0.8 * fact(*scene, "touched_vertices"));
  EXPECT_GT(fact(*scene, "held_vertices"), 20);
  EXPECT_LT(fact(*scene, "slip_mean"), 0.02);
}

TEST_P(ContactClaims, TheCapeStreamsBehindItsWearerAndIsNotStretched) {
  const auto scene = make("cape", {.cells = 10});
  run(*scene, 1.8);
  EXPECT_GT(fact(*scene, "furthest_behind"), 0.4);
  run(*scene, 2.4);
  EXPECT_LT(fact(*scene, "longest_edge"), 1.2);
  EXPECT_EQ(scene->penetration(), 0);
}

}  // namespace
}  // namespace penalty::demo
