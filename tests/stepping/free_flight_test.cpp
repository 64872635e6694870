// Bodies that nothing touches keep both momenta, and their energy stays where it was.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// Flying, spinning and trembling.
Body thrown_beam(unsigned seed) {
  Random random(seed);
  Body beam = make_beam_body(1, {.young = 1e6, .poisson = 0.4});
  for (Real& w : beam.particles().inverse_masses) w *= random.uniform(0.5, 2);
  estimate_stability(beam.body);
  const Vector3 spin(0.7, -1.1, 1.9);
  for (int i = 0; i < beam.particles().size(); ++i)
    beam.set_velocity(i, Vector3(2, 1, -3) + spin.cross(beam.position(i)) + random.vector(0.5));
  return beam;
}

TEST(FreeFlight, KeepsMomentaAndEnergy) {
  WorstError linear, angular;
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Body beam = thrown_beam(seed);
    const Momentum start = momentum({&beam});
    const Real energy = kinetic_energy(beam.particles());
    Real least = energy, most = energy;
    int retries = 0;
    for (int step = 0; step < 2000; ++step) {
      advance(beam, 1.0 / 60);
      ASSERT_TRUE(beam.body.report.finite);
      retries += beam.body.report.retries;
      least = std::min(least, beam.energy());
      most = std::max(most, beam.energy());
      const Momentum now = momentum({&beam});
      linear.see((now.linear - start.linear).norm() / start.linear.norm(), seed);
      angular.see((now.angular - start.angular).norm() / start.angular.norm(), seed);
    }
    RecordProperty("energy_seed_" + std::to_string(seed), std::to_string(least / energy - 1) + " to " +
                                                              std::to_string(most / energy - 1) + ", retries " +
                                                              std::to_string(retries));
    EXPECT_LT(most, 1.002 * energy);
    EXPECT_GT(least, 0.998 * energy);
    EXPECT_GT(beam.body.report.elastic_energy, 1e-3 * energy) << "the body did not move against itself";
  }
  linear.expect_below(1e-12, "linear momentum");
  angular.expect_below(1e-12, "angular momentum");
}

TEST(FreeFlight, WithDampingKeepsMomentaAndLosesOnlyEnergyOfDeformation) {
  // A small tremble under a large damping dies out; what is left is rigid motion about the same momenta.
  WorstError linear, angular;
  for (const Real damping_time : {1e-3, 0.05, 100.0}) {
    SCOPED_TRACE("damping time " + std::to_string(damping_time));
    Body beam = thrown_beam(7);
    beam.body.options.damping_time = damping_time;
    const Momentum start = momentum({&beam});
    Real last = kinetic_energy(beam.particles());
    const Real first = last;
    for (int step = 0; step < 500; ++step) {
      advance(beam, 1.0 / 60);
      ASSERT_TRUE(beam.body.report.finite);
      ASSERT_LT(beam.energy(), last * 1.005) << "step " << step;
      last = beam.energy();
      const Momentum now = momentum({&beam});
      linear.see((now.linear - start.linear).norm() / start.linear.norm(), 7);
      angular.see((now.angular - start.angular).norm() / start.angular.norm(), 7);
    }
    EXPECT_LT(last, first);
  }
  linear.expect_below(1e-12, "linear momentum");
  angular.expect_below(1e-12, "angular momentum");
}

TEST(FreeFlight, IsTheSameInAMovingFrame) {
  // Galilei: the same noise with and without a common velocity differs by the common motion only.
  Body still = thrown_beam(2), moving = thrown_beam(2);
  const Vector3 common(8, -4, 2);
  for (int i = 0; i < moving.particles().size(); ++i) moving.set_velocity(i, moving.velocity(i) + common);
  for (Body* body : {&still, &moving}) body->body.options = {.substeps = 20, .energy_tolerance = 1e300};
  for (int step = 0; step < 64; ++step) {
    advance(still, 1.0 / 64);
    advance(moving, 1.0 / 64);
  }
  Real error = 0;
  for (int i = 0; i < still.particles().size(); ++i)
    error = std::max(error, (moving.position(i) - still.position(i) - common).norm());
  EXPECT_GT((still.position(0) - still.field->rest_positions().col(0).head<3>()).norm(), 0.1);
  EXPECT_LT(error, 1e-11);
}

TEST(FreeFlight, OfTwoBodiesInOneIslandIsThatOfEachAlone) {
  Body a = thrown_beam(1), b = thrown_beam(2), alone = thrown_beam(1);
  for (Body* body : {&a, &b, &alone}) body->body.options.substeps = 30;
  for (int step = 0; step < 20; ++step) {
    advance({&a, &b}, 1.0 / 60);
    advance(alone, 1.0 / 60);
  }
  EXPECT_EQ(a.particles().positions, alone.particles().positions);
  EXPECT_EQ(a.particles().velocities, alone.particles().velocities);
}

TEST(FreeFlight, IsReversible) {
  // Velocity Verlet run backwards returns to where it started, up to round-off.
  Body beam = thrown_beam(4);
  beam.body.options = {.substeps = 20, .energy_tolerance = 1e300};
  const PackedVectors start = beam.particles().positions;
  for (int step = 0; step < 30; ++step) advance(beam, 1.0 / 60);
  EXPECT_GT((beam.particles().positions - start).cwiseAbs().maxCoeff(), 0.5);
  beam.particles().velocities *= -1;
  for (int step = 0; step < 30; ++step) advance(beam, 1.0 / 60);
  EXPECT_LT((beam.particles().positions - start).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace penalty::testing
