// One-sided constraints between particles and rigid bodies, most of which are held or driven.
#include <numbers>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

constexpr Real gravity = 10;  // [m/s²], along -y

// A particle on or above the plane through the origin whose normal is turned by `angle` from +y towards +x.
struct OnPlane {
  Body body;
  RigidBody plane;
  Vector3 normal, downhill;

  explicit OnPlane(Real mass, Real angle = 0, Real friction = 0)
      : body(make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {mass})),
        normal(std::sin(angle), std::cos(angle), 0),
        downhill(std::cos(angle), -std::sin(angle), 0) {
    body.body.gravity = Vector3(0, -gravity, 0);
    body.body.options.substeps = 7;
    body.touch(WeightedPoint::at_particle(0), 0, {0, 0, 0}, normal, friction);
  }
  void step(Real duration) { advance(body, duration, std::span(&plane, 1)); }
  Vector3 x() const { return body.position(0); }
};

TEST(Contact, AFallingParticleStopsAtThePlaneAndNeverPassesIt) {
  OnPlane p(3);
  p.body.set_position(0, {0, 1, 0});
  Real lowest = 1;
  for (int step = 0; step < 120; ++step) {
    p.step(1.0 / 60);
    lowest = std::min(lowest, p.x().y());
    ASSERT_LE(p.body.body.report.contact_depth, 1e-15);
    ASSERT_EQ(p.body.body.report.retries, 0) << "step " << step;
    if (step == 25) {  // 26/60 s < sqrt(2/10) s: still a free fall
      EXPECT_NEAR(p.x().y(), 1 - 5 * std::pow(26.0 / 60, 2), 1e-14);
    }
  }
  EXPECT_GE(lowest, -1e-15);
  EXPECT_NEAR(p.x().y(), 0, 1e-15);
  EXPECT_EQ(p.x().x(), 0);
  EXPECT_LE(std::abs(p.body.velocity(0).y()), gravity / 60 / 7 / 2 * (1 + 1e-12));  // the last half kick
  EXPECT_EQ(p.body.body.report.num_contacts, 1);
  EXPECT_EQ(p.plane.position, Vector3(0, 0, 0));
}

TEST(Contact, IsOneSided) {
  OnPlane p(1);
  p.body.body.gravity.setZero();
  p.body.set_velocity(0, {1, 2, 3});
  p.step(0.5);
  EXPECT_LT((p.x() - Vector3(0.5, 1, 1.5)).norm(), 1e-15);
  EXPECT_EQ(p.body.velocity(0), Vector3(1, 2, 3));
}

TEST(Contact, WithoutFrictionKeepsTheTangentialSpeed) {
  OnPlane p(0.7);
  p.body.set_velocity(0, {4, -3, -2});
  for (int step = 0; step < 64; ++step) p.step(1.0 / 64);
  EXPECT_EQ(p.body.velocity(0).x(), 4);
  EXPECT_EQ(p.body.velocity(0).z(), -2);
  EXPECT_LT((p.x() - Vector3(4, 0, -2)).norm(), 1e-12);
}

TEST(Contact, OnAnInclineSlipsWithTheCoulombAcceleration) {
  // g (sin a - mu cos a) t²/2 downhill; the kicks before a drift add up to the midpoint speed, so it is exact.
  const Real angle = std::numbers::pi / 6;
  for (const Real friction : {0.0, 0.2, 0.5}) {
    SCOPED_TRACE("friction " + std::to_string(friction));
    ASSERT_LT(friction, std::tan(angle));
    OnPlane p(2, angle, friction);
    for (int step = 1; step <= 90; ++step) {
      p.step(1.0 / 60);
      const Real t = step / 60.0;
      const Real expected = gravity * (std::sin(angle) - friction * std::cos(angle)) * t * t / 2;
      ASSERT_LT((p.x() - expected * p.downhill).norm(), 1e-12) << "step " << step;
    }
  }
}

TEST(Contact, OnAnInclineSticksBelowTheAngleOfFriction) {
  const Real angle = std::numbers::pi / 6;
  OnPlane p(2, angle, std::tan(angle) * 1.001);
  for (int step = 0; step < 120; ++step) p.step(1.0 / 60);
  EXPECT_LT(p.x().norm(), 1e-13);
}

TEST(Contact, FrictionStopsASlideAfterVSquaredOverTwoMuG) {
  OnPlane p(5, 0, 0.4);
  p.body.set_velocity(0, {2, 0, 1});  // lying: the first normal impulse is that of half a kick
  for (int step = 0; step < 120; ++step) p.step(1.0 / 60);
  const Vector3 way = p.x();
  // The slide ends within a substep h, an error of the order of the last bit of way, mu g h².
  EXPECT_NEAR(way.norm(), 5 / (2 * 0.4 * gravity), 0.4 * gravity * std::pow(1.0 / 420, 2));
  EXPECT_LT(way.cross(Vector3(2, 0, 1)).norm(), 1e-14);  // along the velocity
  EXPECT_LT(p.body.velocity(0).cwiseProduct(Vector3(1, 0, 1)).norm(), 1e-14);
}

TEST(Contact, AConveyorCarriesAParticleUpToItsSpeed) {
  OnPlane p(1, 0, 0.5);
  p.plane.velocity = Vector3(3, 0, 0);
  int retries = 0;
  for (int step = 0; step < 120; ++step) {
    p.step(1.0 / 60);
    retries += p.body.body.report.retries;
  }
  // 0.6 s of mu g = 5 m/s², then 1.4 s at 3 m/s.
  EXPECT_NEAR(p.body.velocity(0).x(), 3, 1e-14);
  EXPECT_NEAR(p.x().x(), 0.9 + 1.4 * 3, 5 * std::pow(1.0 / 420, 2));
  EXPECT_EQ(retries, 0);
}

TEST(Contact, DepthIsTakenBackByASpeedThatFallsWithIt) {
  // (depth - slop) / 0.05 s, for a particle and for a point between particles alike. Gravity holds them down: the speed
  // falls by depth / (0.05 s)² < 10 m/s².
  Eigen::Matrix3Xd positions(3, 3);
  positions << 0, 1, 0, -0.02, -0.02, -0.02, 0, 0, 1;
  Body body = make_free_particles(positions, {1, 2, 5});
  body.body.options.substeps = 10;
  body.body.gravity = Vector3(0, -gravity, 0);
  for (int i = 0; i < 3; ++i) body.touch(WeightedPoint::at_particle(i), 0, {0, 0, 0}, {0, 1, 0});
  RigidBody plane;
  const Real slop = body.body.options.contact_slop, rate = 1.0 / 600 / 0.05;
  for (int step = 1; step <= 20; ++step) {
    advance(body, 1.0 / 60, std::span(&plane, 1));
    ASSERT_EQ(body.body.report.retries, 0);
    for (int i = 0; i < 3; ++i)
      ASSERT_NEAR(body.position(i).y(), -slop - (0.02 - slop) * std::pow(1 - rate, 10 * step), 1e-12)
          << "step " << step;
  }
  EXPECT_LT(body.energy(), 8.0 / 2 * std::pow(0.02 / 0.05 * std::pow(1 - rate, 199) + gravity / 1200, 2));
}

TEST(Contact, DepthIsTakenBackAtHalfAMetreASecondAtMost) {
  // Weights of a point share the speed by mobility; at half a metre a second at most, however deep.
  Eigen::Matrix3Xd positions(3, 3);
  positions << 0, 1, 0, -0.2, -0.2, -0.2, 0, 0, 1;
  Body body = make_free_particles(positions, {1, 2, 5});
  body.body.options.substeps = 10;
  const WeightedPoint centre{{0, 1, 2}, {0.2, 0.3, 0.5}, 3};
  body.touch(centre, 0, {0, 0, 0}, {0, 1, 0});
  RigidBody plane;
  for (int step = 0; step < 20; ++step) advance(body, 1.0 / 60, std::span(&plane, 1));
  const Real height = 0.2 * body.position(0).y() + 0.3 * body.position(1).y() + 0.5 * body.position(2).y();
  EXPECT_NEAR(height, -0.2 + 0.5 * 20 / 60, 1e-12);
  const Real mobility = 0.04 + 0.09 / 2 + 0.25 / 5;
  EXPECT_NEAR(kinetic_energy(body.particles()), 0.25 / 2 / mobility, 1e-12);
  EXPECT_NEAR(body.body.flows.contacts, 0.25 / 2 / mobility, 1e-12);
  EXPECT_NEAR(body.body.flows.contact_loss, 0.25 / 2 / mobility, 1e-12);  // of a plane that comes at that speed
}

TEST(Contact, APinnedPointIsLeftAlone) {
  OnPlane p(1);
  p.body.particles().inverse_masses[0] = 0;
  p.body.set_position(0, {0, -1, 0});
  p.step(1);
  EXPECT_EQ(p.x(), Vector3(0, -1, 0));
}

TEST(Contact, APinnedParticleStopsARigidBodyAndTakesItsDepthBack) {
  // Its side of the contact is then the one that cannot move: at (depth - slop) / 0.05 s, without a change of anything
  // else.
  Body particle = make_free_particles(Eigen::Matrix3Xd(Vector3(0, 0, 0)), {1});
  particle.particles().inverse_masses[0] = 0;
  particle.body.options.substeps = 10;
  RigidBody sphere = make_sphere(2, 1, {0, 1.5, 0});
  sphere.acceleration = Vector3(0, -gravity, 0);
  particle.touch(WeightedPoint::at_particle(0), 0, {0, -1, 0}, {0, -1, 0});
  for (int step = 0; step < 60; ++step) {
    advance(particle, 1.0 / 60, std::span(&sphere, 1));
    ASSERT_GE(sphere.position.y(), 1 - 1e-14);
    ASSERT_EQ(particle.body.report.retries, 0);
  }
  EXPECT_NEAR(sphere.position.y(), 1, 1e-14);
  EXPECT_EQ(particle.position(0), Vector3(0, 0, 0));
  EXPECT_EQ(particle.velocity(0), Vector3(0, 0, 0));
  sphere.position.y() = 0.98;
  const Real slop = particle.body.options.contact_slop;
  for (int step = 1; step <= 20; ++step) {
    advance(particle, 1.0 / 60, std::span(&sphere, 1));
    ASSERT_NEAR(1 - sphere.position.y(), slop + (0.02 - slop) * std::pow(1 - 1.0 / 600 / 0.05, 10 * step), 1e-12);
    ASSERT_EQ(particle.body.report.retries, 0);
  }
}

TEST(Contact, ADrivenPointPushesARigidBodyAndItsDriverDoesTheWork) {
  // One of three particles is driven, at 3 m/s, and carries 0.4 of the point.
  for (const bool all : {false, true}) {
    SCOPED_TRACE(all ? "all driven" : "one driven");
    Eigen::Matrix3Xd positions(3, 3);
    positions << -2, -2, -2, -1, 1, 0, 0, 0, 0;
    Body body = make_free_particles(positions, {1, 1, 1});
    for (int i = 0; i < 3; ++i) {
      if (i == 0 || all) body.particles().inverse_masses[i] = 0;
      body.set_velocity(i, {3, 0, 0});
    }
    body.body.options.substeps = 8;
    RigidBody sphere = make_sphere(200, 1, {0, 0, 0});
    const WeightedPoint point{{0, 1, 2}, {0.4, 0.4, 0.2}, 3};
    body.touch(point, 0, {-1, 0, 0}, {-1, 0, 0});
    for (int step = 0; step < 30; ++step) {
      advance(body, 1.0 / 60, std::span(&sphere, 1));
      ASSERT_EQ(body.body.report.retries, 0) << "its energy is accounted for";
    }
    EXPECT_EQ(body.velocity(0), Vector3(3, 0, 0));
    const Vector3 at_point = point.of(body.particles().velocities);
    EXPECT_NEAR(sphere.velocity.x() - at_point.x(), 0, 1e-13) << "perfectly plastic";
    if (all) {
      EXPECT_NEAR(sphere.velocity.x(), 3, 1e-13);
      EXPECT_NEAR(body.body.flows.contact_loss, 200 * 9.0 / 2, 1e-9) << "as much as the sphere got";
    } else {
      EXPECT_LT(sphere.velocity.x(), 0.1) << "the free particles gave way";
      EXPECT_GT(sphere.velocity.x(), 0.01);
    }
  }
}

TEST(Contact, AMovingPlanePushesABodyWithoutEndlessRepeats) {
  Body beam = make_beam_body(1);
  RigidBody plane;
  plane.position = Vector3(0, -0.05, 0);
  plane.velocity = Vector3(0, 1.5, 0);
  for (int i = 0; i < beam.particles().size(); ++i)
    beam.touch(WeightedPoint::at_particle(i), 0, {0, 0, 0}, {0, 1, 0}, 0.2);
  int retries = 0, most_retries = 0;
  Real depth = 0;
  for (int step = 0; step < 120; ++step) {
    advance(beam, 1.0 / 60, std::span(&plane, 1));
    ASSERT_TRUE(beam.body.report.finite);
    retries += beam.body.report.retries;
    most_retries = std::max(most_retries, beam.body.report.retries);
    depth = std::max(depth, beam.body.report.contact_depth);
  }
  RecordProperty("retries", retries);
  EXPECT_NEAR(plane.position.y(), 2.95, 1e-12);
  EXPECT_TRUE(plane.impulse.isZero(0));  // it takes none
  EXPECT_GE(beam.particles().positions.row(1).minCoeff(), plane.position.y() - 1e-13);
  EXPECT_LT(depth, 1e-13);
  EXPECT_GT(linear_momentum(beam.particles()).y(), 4000 * 1.4);
  EXPECT_LE(most_retries, 2);
  EXPECT_LE(retries, 6);
}

TEST(Contact, ABodyDroppedOnThePlaneGainsNoEnergyAndNeverPassesIt) {
  Body beam = make_beam_body(1);
  beam.particles().positions.row(1).array() += 0.5;
  beam.body.gravity = Vector3(0, -gravity, 0);
  RigidBody plane;
  for (int i = 0; i < beam.particles().size(); ++i) beam.touch(WeightedPoint::at_particle(i), 0, {0, 0, 0}, {0, 1, 0});
  const auto total = [&] {
    Real potential = 0;
    for (int i = 0; i < beam.particles().size(); ++i)
      potential += gravity * beam.position(i).y() / beam.particles().inverse_masses[i];
    return beam.energy() + potential;
  };
  advance(beam, 1e-6, std::span(&plane, 1));
  const Real start = total();
  Real last = start;
  for (int step = 0; step < 240; ++step) {
    advance(beam, 1.0 / 60, std::span(&plane, 1));
    ASSERT_GE(beam.particles().positions.row(1).minCoeff(), -1e-13);
    ASSERT_LT(total(), last + 0.01 * start) << "step " << step;
    last = total();
  }
  EXPECT_LT(last, 1.01 * start);
  const Vector3 p = linear_momentum(beam.particles());
  EXPECT_LT(std::hypot(p.x(), p.z()), 1e-9);
}

}  // namespace
}  // namespace penalty::testing
