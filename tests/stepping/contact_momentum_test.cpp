// Contacts between what is free to move, particles and rigid bodies or particles alone, keep both momenta.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

TEST(Contact, ACentralHitOnAFreeBodyIsPerfectlyPlastic) {
  Body particle = make_free_particles(Eigen::Matrix3Xd(Vector3(-2, 0, 0)), {1});
  particle.set_velocity(0, {3, 0, 0});
  particle.body.options.substeps = 8;
  RigidBody sphere = make_sphere(2, 1, {0, 0, 0});
  particle.touch(WeightedPoint::at_particle(0), 0, {-1, 0, 0}, {-1, 0, 0});
  for (int step = 0; step < 30; ++step) advance(particle, 1.0 / 60, std::span(&sphere, 1));
  // 1 kg at 3 m/s and 2 kg at rest: 1 m/s together. The particle touches after 1/3 s.
  EXPECT_LT((particle.velocity(0) - Vector3(1, 0, 0)).norm(), 1e-14);
  EXPECT_LT((sphere.velocity - Vector3(1, 0, 0)).norm(), 1e-14);
  EXPECT_LT((sphere.impulse - Vector3(2, 0, 0)).norm(), 1e-14);
  EXPECT_TRUE(sphere.angular_velocity.isZero(0));
  EXPECT_NEAR(particle.position(0).x(), sphere.position.x() - 1, 1e-14);
}

// Hits of one contact point, off the centre, with friction, on a flying and spinning sphere.
void expect_momentum_kept(const std::string& what, const Eigen::Matrix3Xd& offsets, const std::vector<Real>& masses,
                          const WeightedPoint& point) {
  SCOPED_TRACE(what);
  WorstError linear, angular;
  int hits = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    Random random(seed);
    RigidBody sphere = make_sphere(random.uniform(0.1, 10), 0.8, random.vector(3));
    sphere.rotation = random.rotation();
    sphere.velocity = random.vector(1);
    sphere.angular_velocity = random.vector(5);
    const Vector3 normal = random.direction();
    Vector3 middle = Vector3::Zero();
    for (int k = 0; k < point.size; ++k) middle += point.weights[k] * offsets.col(point.particles[k]);
    const Vector3 touch = sphere.position + 0.8 * (normal + 0.3 * random.vector(1)).normalized();
    const Vector3 shift = touch + 0.05 * normal - middle;
    const Eigen::Matrix3Xd start = offsets.colwise() + shift;
    Body body = make_free_particles(start, masses);
    body.body.options.substeps = 10;
    for (int i = 0; i < body.particles().size(); ++i) body.set_velocity(i, random.vector(1) - 8 * normal);
    body.touch(point, 0, sphere.rotation.transpose() * (touch - sphere.position), sphere.rotation.transpose() * normal,
               random.uniform(0, 1));
    const Momentum before = momentum({&body}, std::span(&sphere, 1));
    const Real energy = kinetic_energy(body.particles());
    for (int step = 0; step < 3; ++step) {
      advance(body, 1.0 / 60, std::span(&sphere, 1));
      ASSERT_EQ(body.body.report.retries, 0) << "seed " << seed;
    }
    hits += sphere.impulse.norm() > 0.1;
    EXPECT_NE(kinetic_energy(body.particles()), energy);
    const Momentum after = momentum({&body}, std::span(&sphere, 1));
    const Real scale = before.linear.norm() + sphere.impulse.norm();
    linear.see((after.linear - before.linear).norm() / scale, seed);
    angular.see((after.angular - before.angular).norm() / (before.angular.norm() + scale * sphere.position.norm()),
                seed);
  }
  EXPECT_GT(hits, 30);
  linear.expect_below(1e-14, "linear momentum of " + what);
  angular.expect_below(1e-14, "angular momentum of " + what);
}

TEST(Contact, AParticleAndAFreeBodyKeepBothMomenta) {
  expect_momentum_kept("a particle", Eigen::Matrix3Xd::Zero(3, 1), {0.7}, WeightedPoint::at_particle(0));
}

TEST(Contact, APointBetweenParticlesAndAFreeBodyKeepBothMomenta) {
  Eigen::Matrix3Xd triangle(3, 4);
  triangle << 0, 1, 0, 5, 0, 0, 1, 5, 0.1, 0, 0, 5;
  expect_momentum_kept("a point of a face", triangle, {0.7, 1.5, 0.2, 1}, {{0, 1, 2}, {0.2, 0.5, 0.3}, 3});
}

TEST(Contact, OfAnElasticBodyWithAFreeBodyKeepsBothMomentaAndGainsNoEnergy) {
  Body beam = make_beam_body(1);
  RigidBody sphere = make_sphere(500, 0.5, {2, -0.6, 0.5});
  sphere.velocity = Vector3(0, 4, 0);
  sphere.angular_velocity = Vector3(1, 2, 6);
  for (int i = 0; i < beam.particles().size(); ++i)
    if (std::abs(beam.position(i).x() - 2) < 1.1 && beam.position(i).y() < 0.1)
      beam.touch(WeightedPoint::at_particle(i), 0, {0, 0.5, 0}, {0, 1, 0}, 0.3);
  ASSERT_GE(beam.contacts.size(), 3u);
  const Momentum before = momentum({&beam}, std::span(&sphere, 1));
  const Real energy = 0.5 * 500 * 16 + 0.5 * 0.4 * 500 * 0.25 * 41;
  for (int step = 0; step < 30; ++step) advance(beam, 1.0 / 60, std::span(&sphere, 1));
  EXPECT_GT(sphere.impulse.norm(), 100);
  const Momentum after = momentum({&beam}, std::span(&sphere, 1));
  EXPECT_LT((after.linear - before.linear).norm(), 1e-13 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-13 * before.angular.norm());
  const Real left = beam.energy() + 0.5 * 500 * sphere.velocity.squaredNorm() +
                    0.5 * 0.4 * 500 * 0.25 * sphere.angular_velocity.squaredNorm();
  EXPECT_LT(left, 1.005 * energy);
  EXPECT_GT(left, 0.2 * energy);
}

TEST(Contact, OfTwoBodiesWithOneRigidBodyKeepsMomenta) {
  // A sphere between two beams that close in on it.
  Body below = make_beam_body(1), above = make_beam_body(1);
  for (int i = 0; i < above.particles().size(); ++i) {
    above.set_position(i, above.position(i) + Vector3(0.3, 2.2, 0.1));
    above.set_velocity(i, {0, -3, 0.2});
    below.set_velocity(i, {0.1, 2, 0});
  }
  RigidBody sphere = make_sphere(800, 0.5, {2, 1.6, 0.5});
  sphere.angular_velocity = Vector3(0, 1, 4);
  for (int i = 0; i < below.particles().size(); ++i) {
    if (std::abs(below.position(i).x() - 2) < 1.1 && below.position(i).y() > 0.9)
      below.touch(WeightedPoint::at_particle(i), 0, {0, -0.5, 0}, {0, -1, 0}, 0.4);
    if (std::abs(above.position(i).x() - 2) < 1.1 && above.position(i).y() < 2.3)
      above.touch(WeightedPoint::at_particle(i), 0, {0, 0.5, 0}, {0, 1, 0}, 0.4);
  }
  ASSERT_GE(below.contacts.size(), 3u);
  ASSERT_GE(above.contacts.size(), 3u);
  const auto island = [&] { return momentum({&below, &above}, std::span(&sphere, 1)); };
  const Momentum before = island();
  for (int step = 0; step < 30; ++step) {
    advance({&below, &above}, 1.0 / 60, std::span(&sphere, 1));
    ASSERT_TRUE(below.body.report.finite && above.body.report.finite);
  }
  EXPECT_GT(below.body.report.elastic_energy, 1);
  EXPECT_GT(above.body.report.elastic_energy, 1);
  Real scale = 0;
  for (const Body* body : {&below, &above})
    for (int i = 0; i < body->particles().size(); ++i)
      scale += body->velocity(i).norm() / body->particles().inverse_masses[i];
  EXPECT_LT((island().linear - before.linear).norm(), 1e-13 * scale);
  EXPECT_LT((island().angular - before.angular).norm(), 1e-13 * scale * 4);
}

// A contact whose sides are both of particles, side b of the second body.
Contact between(const WeightedPoint& a, const WeightedPoint& b, const Vector3& normal, Real friction = 0) {
  return {.a = Side::of_particles(0, a), .b = Side::of_particles(1, b), .normal = normal, .friction = friction};
}

TEST(Contact, ACentralHitOfTwoSoftBodiesIsPerfectlyPlastic) {
  Body left = make_free_particles(Eigen::Matrix3Xd(Vector3(-1, 0, 0)), {1});
  Body right = make_free_particles(Eigen::Matrix3Xd(Vector3(0, 0, 0)), {2});
  left.set_velocity(0, {3, 0, 0});
  left.body.options.substeps = right.body.options.substeps = 8;
  left.contacts = {between(WeightedPoint::at_particle(0), WeightedPoint::at_particle(0), {-1, 0, 0})};
  for (int step = 0; step < 30; ++step) advance({&left, &right}, 1.0 / 60);
  EXPECT_LT((left.velocity(0) - Vector3(1, 0, 0)).norm(), 1e-14);
  EXPECT_LT((right.velocity(0) - Vector3(1, 0, 0)).norm(), 1e-14);
  EXPECT_LT((left.position(0) - right.position(0)).norm(), 1e-14);
  EXPECT_EQ(right.body.report.num_contacts, 1) << "it is a contact of both";
  // 4.5 J before, 1.5 J after: of the left body's 4 J go to the other and are lost.
  EXPECT_NEAR(left.body.flows.contacts, -4, 1e-13);
  EXPECT_NEAR(right.body.flows.contacts, 1, 1e-13);
  EXPECT_NEAR(left.body.flows.contact_loss, 3, 1e-13);
}

TEST(Contact, OfPointsOfTwoFacesKeepsMomentumAndRubs) {
  Eigen::Matrix3Xd triangle(3, 3);
  triangle << 0, 1, 0, 0, 0, 0, 0, 0, 1;
  const WeightedPoint above_point{{0, 1, 2}, {0.2, 0.5, 0.3}, 3}, below_point{{0, 2, 1}, {0.3, 0.3, 0.4}, 3};
  for (const Real friction : {0.0, 0.3, 5.0}) {
    Body below = make_free_particles(triangle, {1, 2, 3}), above = make_free_particles(triangle, {0.5, 0.7, 0.2});
    const Vector3 shift = below_point.of(below.particles().positions) - above_point.of(above.particles().positions);
    for (int i = 0; i < 3; ++i) {
      above.set_position(i, above.position(i) + shift);  // the points coincide
      above.set_velocity(i, {1, -2, 0.5});
    }
    above.body.options.substeps = below.body.options.substeps = 1;
    above.contacts = {between(above_point, below_point, {0, 1, 0}, friction)};
    const Momentum before = momentum({&above, &below});
    advance({&above, &below}, 1e-9);
    const Momentum after = momentum({&above, &below});
    EXPECT_LT((after.linear - before.linear).norm(), 1e-14);
    EXPECT_LT((after.angular - before.angular).norm(), 1e-8) << "but for the drift of 1e-9 s";
    const Vector3 slip = above_point.of(above.particles().velocities) - below_point.of(below.particles().velocities);
    EXPECT_NEAR(slip.y(), 0, 1e-14);
    const Real along = std::hypot(slip.x(), slip.z()), before_along = std::hypot(1, 0.5);
    EXPECT_NEAR(along, std::max(0.0, before_along - friction * 2), 1e-13)
        << "Coulomb: mu times the normal change of speed";
  }
}

}  // namespace
}  // namespace penalty::testing
