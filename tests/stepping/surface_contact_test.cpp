// Contact between surfaces of soft bodies, and within one. What crosses is counted from positions, in every frame.
#include <numbers>

#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"
#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

Matrix3 turned(Real angle, const Vector3& axis) { return Eigen::AngleAxis<Real>(angle, axis.normalized()).matrix(); }

// A triangle and what falls on it: particles without forces between them.
struct TriangleAndPoint {
  Body triangle, point;
  ContactSurface under, over;
  SurfacePair pair;

  TriangleAndPoint(Real triangle_mass, Real point_mass, Real friction, const Vector3& start)
      : triangle(make_free_particles(corners(), std::vector<Real>(3, triangle_mass / 3))),
        point(make_free_particles(Eigen::Matrix3Xd(start), {point_mass})),
        under({WeightedPoint::at_particle(0), WeightedPoint::at_particle(1), WeightedPoint::at_particle(2)},
              {{0, 1, 2}}, {}, triangle.particles().positions),
        over({WeightedPoint::at_particle(0)}, {}, {}, point.particles().positions),
        pair((under.margin = over.margin = 0.05, under), over) {
    under.friction = 1;
    over.friction = friction;
  }
  static Eigen::Matrix3Xd corners() {
    Eigen::Matrix3Xd x(3, 3);
    x << -1, 1, 0, 0, 0, 0, std::sqrt(3.0) / 3, std::sqrt(3.0) / 3, -2 * std::sqrt(3.0) / 3;
    return x;
  }
  void step(Real duration) {
    Island island;
    island.bodies = {&triangle.body, &point.body};
    island.surfaces = {{&pair, 0, 1}};
    advance(island, duration);
  }
};

TEST(SurfaceContact, APointThatHitsTheMiddleOfATriangleStaysWithIt) {
  // 1 kg at 3 m/s and 2 kg at rest: 1 m/s together, a thickness of 0.05 m apart, whichever side it comes from.
  for (const Real side : {1.0, -1.0}) {
    TriangleAndPoint t(2, 1, 0, {0, 2 * side, 0});
    t.point.set_velocity(0, {0, -3 * side, 0});
    for (int k = 0; k < 60; ++k) t.step(frame);
    EXPECT_NEAR(t.point.velocity(0).y(), -side, 1e-13);
    for (int i = 0; i < 3; ++i) {
      EXPECT_LT((t.triangle.velocity(i) - Vector3(0, -side, 0)).norm(), 1e-13);
      EXPECT_NEAR(side * (t.point.position(0).y() - t.triangle.position(i).y()), 0.05, 1e-12);
    }
    EXPECT_NEAR(t.point.body.flows.contacts + t.triangle.body.flows.contacts, -4.5 + 1.5, 1e-12);
    EXPECT_NEAR(t.point.body.flows.contact_loss + t.triangle.body.flows.contact_loss, 3, 1e-12);
  }
}

TEST(SurfaceContact, APointSlidesDownAPinnedTriangleWithTheCoulombAcceleration) {
  const Real angle = std::numbers::pi / 6, gravity = 10;
  for (const Real friction : {0.0, 0.2, 0.5, 0.6}) {
    SCOPED_TRACE(friction);
    TriangleAndPoint t(3, 1, friction, {-0.4, 0.05, 0.3});
    t.triangle.particles().inverse_masses.assign(3, 0);
    t.point.body.gravity = gravity * Vector3(std::sin(angle), -std::cos(angle), 0);
    for (int k = 1; k <= 30; ++k) {
      t.step(frame);
      const Real time = k * frame, a = std::max<Real>(gravity * (std::sin(angle) - friction * std::cos(angle)), 0);
      ASSERT_NEAR(t.point.position(0).x(), -0.4 + a * time * time / 2, 1e-12);
      ASSERT_NEAR(t.point.position(0).y(), 0.05, 1e-12);
      ASSERT_EQ(t.point.body.report.retries, 0);
    }
  }
}

TEST(SurfaceContact, FastPointsDoNotPassAThinTriangle) {
  for (const Real speed : {5.0, 50.0, 500.0, 5000.0}) {
    TriangleAndPoint t(2, 1, 0.5, {0.1, 1, -0.1});
    t.point.set_velocity(0, {0.01 * speed, -speed, 0});
    for (int k = 0; k < 6; ++k) {
      t.step(frame);
      const Vector3 a = t.triangle.position(0);
      const Vector3 n = (t.triangle.position(1) - a).cross(t.triangle.position(2) - a);
      if (k == 0) {
        ASSERT_GT(n.y(), 0);
      }
      ASSERT_GT(n.dot(t.point.position(0) - a), 0) << speed << " m/s, step " << k;
    }
  }
}

// Balls that hit each other off the centre, without gravity.
class Hit : public ::testing::TestWithParam<std::tuple<Real, Integrator>> {};

TEST_P(Hit, KeepsBothMomentaAndCrossesNothing) {
  const auto [friction, integrator] = GetParam();
  const bool is_implicit = integrator == Integrator::implicit_step;
  const TetMesh ball = make_ball(0.5, 2);
  for (const Real speed : {0.5, 5.0, 50.0}) {
    SCOPED_TRACE(speed);
    SurfaceBodies bodies;
    bodies.friction = friction;
    bodies.integrator = integrator;
    bodies.damping_time = 0.002;
    bodies.add(ball, 10, 1, {.shift = {-0.55, 0, 0}, .velocity = {speed / 2, 0, 0}});
    bodies.add(ball, 10, 3,
               {.shift = {0.55, 0.3, 0.2}, .velocity = {-speed / 2, 0, 0}, .rotation = turned(1, {1, 2, 3})});
    const Momentum start = bodies.momentum();
    const Real energy = bodies.energy();
    Real highest = 0, last = energy, gain = 0;
    for (int k = 0; k < (speed < 1 ? 60 : 20); ++k) {
      bodies.step();
      for (const int b : {0, 1})
        ASSERT_EQ(bodies[b].body.report.integrator == Integrator::implicit_step, is_implicit) << "frame " << k;
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
      highest = std::max(highest, bodies.energy());
      gain = std::max(gain, bodies.energy() - last);
      last = bodies.energy();
    }
    const Momentum end = bodies.momentum();
    EXPECT_LT((end.linear - start.linear).norm(), 1e-13 * speed);
    EXPECT_LT((end.angular - start.angular).norm(), 1e-13 * speed);
    EXPECT_LE(highest, energy * (1 + 1e-9));
    if (is_implicit) {
      EXPECT_LE(gain, 1e-12 * energy);
    }
    EXPECT_LT(bodies.energy(), (is_implicit ? 0.9 : 0.99) * energy) << "did not hit";
  }
}

INSTANTIATE_TEST_SUITE_P(Friction, Hit,
                         ::testing::Combine(::testing::Values(0, 0.5, 1),
                                            ::testing::Values(Integrator::automatic, Integrator::implicit_step)));

TEST(SurfaceContact, FrictionTurnsWhatIsHitOffItsCentre) {
  // Two equal balls that pass each other, just touching: both slow down and turn the same way round.
  const auto spin_after = [](Real friction) {
    SurfaceBodies bodies;
    bodies.friction = friction;
    const TetMesh ball = make_ball(0.5, 2);
    bodies.add(ball, 100, 1, {.shift = {-0.4, 0, 0}, .velocity = {1, 0, 0}});
    bodies.add(ball, 100, 1, {.shift = {0.4, 0.98, 0}, .velocity = {-1, 0, 0}});
    bodies.step(frame, 60);
    Vector3 spin = Vector3::Zero();
    for (int k = 0; k < 2; ++k) {
      const Particles& p = bodies[k].particles();
      const Vector3 center = p.positions.rowwise().mean().head<3>();
      spin += angular_momentum(p, center);
    }
    return spin.z();
  };
  const Real rough = spin_after(0.5), smooth = spin_after(0);
  EXPECT_GT(std::abs(rough), 2 * std::abs(smooth) + 1e-3);  // facets catch each other a little
}

TEST(SurfaceContact, ClothsThatMeetAtFiftyMetresASecondDoNotPass) {
  const TriangleSurface sheet = make_sheet(1, 1, 12, 12);
  SurfaceBodies bodies;
  bodies.friction = 0.5;
  bodies.damping_time = 0.002;
  bodies.add_cloth(sheet, 1, 1e-4, 0.3, {.shift = {0, 0, -0.4}, .velocity = {0, 0, 25}});
  bodies.add_cloth(sheet, 1, 1e-4, 0.3,
                   {.shift = {0.1, 0.3, 0.4}, .velocity = {0, 0, -25}, .rotation = turned(0.4, {1, 1, 0})});
  const Momentum start = bodies.momentum();
  const Real energy = bodies.energy();
  for (int k = 0; k < 8; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
  }
  EXPECT_LT(bodies.energy(), 0.95 * energy) << "did not hit";
  EXPECT_LT((bodies.momentum().linear - start.linear).norm(), 1e-13 * 0.6 * 25);
  EXPECT_LT((bodies.momentum().angular - start.angular).norm(), 1e-13 * 0.6 * 25);
}

TEST(SurfaceContact, AClothFallsIntoFoldsOnTheFloor) {
  SurfaceBodies bodies;
  bodies.margin = 0.01;
  bodies.friction = 0.5;
  bodies.damping_time = 0.005;
  bodies.gravity = {0, -9.81, 0};
  bodies.floors = {0};
  bodies.add_cloth(make_sheet(1, 1, 20, 20), 0.1, 2e-5, 0.3,
                   {.shift = {0, 0.02, 0}, .rotation = turned(0.05, {1, 0, 0})});
  const Real start = bodies.energy();
  Real energy = start, gain = 0, least = 1;
  for (int k = 0; k < 120; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    least = std::min(least, least_distance(bodies.skins(), true));
    gain = std::max(gain, bodies.energy() - energy);
    energy = bodies.energy();
  }
  EXPECT_GT(least, 0.5 * bodies.margin);
  EXPECT_LT(gain, 2e-5 * start);  // of giving thickness back
  EXPECT_LT(energy, 0.3 * start) << "did not fall";
  EXPECT_LT(bodies.kinetic_energy(), 1e-3);
}

TEST(SurfaceContact, StackedBoxesStandOnEachOther) {
  SurfaceBodies bodies;
  bodies.friction = 0.5;
  bodies.damping_time = 0.05;
  bodies.gravity = {0, -9.81, 0};
  bodies.floors = {0};
  const TetMesh box = make_box({1, 1, 1}, {3, 3, 3});
  for (int k = 0; k < 3; ++k) bodies.add(box, 100, 10, {.shift = {0, 0.02 + 1.03 * k, 0}});
  const Real start = bodies.energy();
  Real energy = start, gain = 0;
  int retries = 0;
  for (int k = 0; k < 180; ++k) {
    bodies.step();
    ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    gain = std::max(gain, bodies.energy() - energy);
    energy = bodies.energy();
    retries += bodies.retries();
  }
  EXPECT_LT(gain, 2e-5 * start);
  EXPECT_EQ(retries, 0);
  EXPECT_GT(least_distance(bodies.skins(), false), 0.97 * bodies.margin);
  for (int k = 0; k < 3; ++k) {
    const Vector3 center = bodies[k].particles().positions.rowwise().mean().head<3>();
    EXPECT_LT((center - Vector3(0.5, 0.5 + k, 0.5)).norm(), 0.05) << "box " << k;
  }
}

TEST(SurfaceContact, WorksAtAnySize) {
  // The same hit in millimetres and hectometres: lengths, speeds and times scaled.
  for (const Real size : {1e-3, 1.0, 100.0}) {
    SCOPED_TRACE(size);
    SurfaceBodies bodies;
    bodies.friction = 0.3;
    bodies.margin = 0.02 * size;
    const TetMesh ball = make_ball(0.5 * size, 2);
    bodies.add(ball, 10, 1, {.shift = size * Vector3(-0.6, 0, 0), .velocity = {2, 0, 0}});
    bodies.add(ball, 10, 1, {.shift = size * Vector3(0.6, 0.3, 0.2), .velocity = {-2, 0, 0}});
    const Momentum start = bodies.momentum();
    for (int k = 0; k < 30; ++k) {
      bodies.step(size * frame);
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
    }
    EXPECT_LT(bodies.kinetic_energy(), 3.9) << "did not hit";
    EXPECT_LT((bodies.momentum().linear - start.linear).norm(), 1e-13);
    EXPECT_LT((bodies.momentum().angular - start.angular).norm(), 1e-13 * size);
  }
}

TEST(SurfaceContact, ADrivenTriangleCarriesWhatLiesOnIt) {
  // All held, moved up at 2 m/s: the point takes its speed, no step is repeated for energy that its driver gives.
  TriangleAndPoint t(3, 1, 0.5, {0.1, 0.2, -0.1});
  t.triangle.particles().inverse_masses.assign(3, 0);
  for (int i = 0; i < 3; ++i) t.triangle.set_velocity(i, {0.3, 2, 0});
  for (int k = 0; k < 60; ++k) {
    t.step(frame);
    ASSERT_EQ(t.point.body.report.retries, 0) << "step " << k;
  }
  EXPECT_LT((t.point.velocity(0) - Vector3(0.3, 2, 0)).norm(), 1e-12);
  EXPECT_NEAR(t.point.position(0).y() - t.triangle.position(0).y(), 0.05, 1e-12);
}

TEST(SurfaceContact, RopesTouchAtTheirEndsAndSideBySide) {
  // Edges of no triangle: there are no triangles that ends might meet instead.
  for (const bool parallel : {false, true}) {
    SCOPED_TRACE(parallel);
    Eigen::Matrix3Xd held(3, 2), thrown(3, 2);
    held << -1, 1, 0, 0, 0, 0;
    if (parallel)
      thrown << -0.9, 0.8, 0.3, 0.3, 0, 0;
    else
      thrown << 0.1, 0.2, 0.3, 1, 0, 0;  // its end comes first
    Body below = make_free_particles(held, {1, 1}), above = make_free_particles(thrown, {1, 1});
    below.particles().inverse_masses.assign(2, 0);
    for (int i = 0; i < 2; ++i) above.set_velocity(i, {0, -3, 0});
    const std::vector<WeightedPoint> ends{WeightedPoint::at_particle(0), WeightedPoint::at_particle(1)};
    ContactSurface one(ends, {}, {{0, 1}}, below.particles().positions),
        two(ends, {}, {{0, 1}}, above.particles().positions);
    one.margin = two.margin = 0.05;
    SurfacePair pair(one, two);
    for (int k = 0; k < 12; ++k) {
      Island island;
      island.bodies = {&below.body, &above.body};
      island.surfaces = {{&pair, 0, 1}};
      advance(island, frame);
      ASSERT_GT(above.position(0).y(), 0.049);
    }
    EXPECT_NEAR(above.velocity(0).y(), 0, 1e-12);
  }
}

TEST(SurfaceContact, DoubledVerticesOfASeamDoNotTouchEachOther) {
  // Two sheets side by side, one mesh, the vertices of the seam twice.
  TriangleSurface sheet = make_sheet(1, 1, 4, 4), seam = sheet;
  const auto n = sheet.vertices.cols();
  seam.vertices.conservativeResize(3, 2 * n);
  seam.vertices.rightCols(n) = sheet.vertices.colwise() + Vector3(1, 0, 0);
  for (const Triangle& t : sheet.triangles)
    seam.triangles.push_back({t[0] + static_cast<int>(n), t[1] + static_cast<int>(n), t[2] + static_cast<int>(n)});
  SurfaceBodies bodies;
  bodies.add_cloth(seam, 1, 1e-4, 1, {.velocity = {1, 2, 3}});
  const Real energy = bodies.energy();
  bodies.step(frame, 20);
  EXPECT_NEAR(bodies.energy(), energy, 1e-12 * energy) << "nothing happens to it";
}

TEST(SurfaceContact, ABodyFarFromOthersIsSteppedAsIfAlone) {
  const TetMesh ball = make_ball(0.3, 2);
  SurfaceBodies alone, together;
  for (SurfaceBodies* bodies : {&alone, &together})
    bodies->add(ball, 10, 1, {.velocity = {1, 2, 3}, .rotation = turned(1, {1, 0, 1})});
  together.add(ball, 10, 1, {.shift = {50, 0, 0}});
  alone.step(frame, 30);
  together.step(frame, 30);
  EXPECT_EQ(alone.substeps(), together.substeps());
  EXPECT_EQ(alone[0].particles().positions, together[0].particles().positions);
}

TEST(SurfaceContact, AFlatClothThatMayTouchItselfIsSteppedImplicitly) {
  SurfaceBodies bodies;
  Body& cloth = bodies.add_cloth(make_sheet(1, 1, 4, 4), 1, 1e-4, 0.3, {.velocity = {0, 1, 0}});
  cloth.body.options.integrator = Integrator::implicit_step;
  for (int k = 0; k < 2; ++k) {  // the first step of a body has none before it
    bodies.step();
    EXPECT_EQ(cloth.body.report.integrator, Integrator::implicit_step) << "step " << k;
    EXPECT_TRUE(cloth.body.report.finite) << "step " << k;
  }
}

TEST(SurfaceContact, GivesTheSameBitsAgain) {
  const auto run = [] {
    SurfaceBodies bodies;
    bodies.friction = 0.5;
    bodies.add(make_ball(0.5, 2), 10, 1, {.shift = {-0.55, 0, 0}, .velocity = {5, 0, 0}});
    bodies.add_cloth(make_sheet(2, 2, 10, 10), 1, 1e-4, 0.3,
                     {.shift = {0.2, -1, -1}, .rotation = turned(1.5, {0, 1, 0})});
    bodies.step(frame, 30);
    return PackedVectors(bodies[1].particles().positions);
  };
  const PackedVectors first = run();
  const auto unrelated = std::make_unique<std::array<char, 12345>>();
  EXPECT_EQ(run(), first);
}

TEST(SurfaceContact, PushesThroughEmbeddedPointsOntoTheirParticles) {
  // A skin of two triangles whose corners lie between particles; a ball of one particle falls on it.
  Eigen::Matrix3Xd x(3, 4);
  x << -1, 1, 1, -1, 0, 0, 0, 0, -1, -1, 1, 1;
  Body frame_body = make_free_particles(x, {1, 1, 1, 1});
  std::vector<WeightedPoint> corners;
  corners.reserve(4);
  for (int i = 0; i < 4; ++i) corners.push_back({{i, (i + 1) % 4, (i + 2) % 4}, {0.8, 0.1, 0.1}, 3});
  ContactSurface skin(corners, {{0, 2, 1}, {0, 3, 2}}, {}, frame_body.particles().positions);
  Body point = make_free_particles(Eigen::Matrix3Xd(Vector3(0.1, 0.5, 0.2)), {2});
  ContactSurface tip({WeightedPoint::at_particle(0)}, {}, {}, point.particles().positions);
  skin.margin = tip.margin = 0.02;
  skin.friction = tip.friction = 0.5;
  SurfacePair pair(skin, tip);
  point.set_velocity(0, {1, -4, 0});
  const Momentum start = momentum({&frame_body, &point});
  for (int k = 0; k < 20; ++k) {
    Island island;
    island.bodies = {&frame_body.body, &point.body};
    island.surfaces = {{&pair, 0, 1}};
    advance(island, frame);
    const Vector3 a = skin.position(0), n = (skin.position(2) - a).cross(skin.position(1) - a);
    ASSERT_GT(n.dot(point.position(0) - a), 0) << "step " << k;
  }
  EXPECT_GT(point.velocity(0).y(), -3) << "did not hit";
  const Momentum end = momentum({&frame_body, &point});
  EXPECT_LT((end.linear - start.linear).norm(), 1e-14);
  EXPECT_LT((end.angular - start.angular).norm(), 1e-14);
}

}  // namespace
}  // namespace penalty::testing
