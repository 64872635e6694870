// Motions that are known exactly.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// Two particles and a spring along `axis`; `stretch` [m] beyond the rest length, separating at `speed`.
struct Oscillator {
  Body body;
  Vector3 axis;
  Real rest_length, omega2;  // of the relative motion

  Oscillator(const Vector3& direction, Real stiffness, Real length, const std::vector<Real>& masses, Real stretch,
             Real speed)
      : axis(direction.normalized()), rest_length(length) {
    Eigen::Matrix3Xd rest(3, 2);
    rest << Vector3::Zero(), length * axis;
    PotentialField field(rest);
    const std::vector<Edge> edge{{0, 1}};
    field.add<Length>(edge, stiffness);
    body = make_body(std::move(field), {1 / masses[0], 1 / masses[1]});
    body.set_position(1, (length + stretch) * axis);
    body.set_velocity(1, speed * axis);
    omega2 = stiffness / (length * length) * (1 / masses[0] + 1 / masses[1]);
  }
  Real stretch() const { return axis.dot(body.position(1) - body.position(0)) - rest_length; }
  Real speed() const { return axis.dot(body.velocity(1) - body.velocity(0)); }
};

TEST(TwoParticleSpring, MatchesTheExactDiscreteSolutionOfVelocityVerlet) {
  // Along its axis C is linear, so the stretch d obeys d'' = -w² d, and velocity Verlet with steps h is
  //   d_n = d_0 cos nt + u_0 (h / sin t) sin nt,   u_n = u_0 cos nt - d_0 (sin t / h) sin nt,   cos t = 1 - (w h)²/2,
  // an ellipse walked at the frequency w_h = t / h, which is above w: sin(w_h h / 2) = w h / 2.
  WorstError position_error, speed_error, centre_error;
  unsigned run = 0;
  for (const Real wh : {0.1, 0.7, 1.5, 1.95}) {
    const Real d0 = 0.02, u0 = wh > 1 ? 0.0 : 0.3;
    Oscillator o({1, 2, -2}, 50, 0.5, {2, 0.7}, d0, u0);
    o.body.body.options.energy_tolerance = 1e300;  // the guard is not part of this
    o.body.body.options.substeps = 8;
    const Real h = wh / std::sqrt(o.omega2), t = std::acos(1 - wh * wh / 2);
    const Vector3 centre_speed = linear_momentum(o.body.particles()) / 2.7;
    const Vector3 centre = 0.7 / 2.7 * (o.rest_length + d0) * o.axis;
    const Real amplitude = std::hypot(d0, u0 * h / std::sin(t));
    for (int step = 1; step <= 50; ++step) {
      advance(o.body, 8 * h);
      ASSERT_EQ(o.body.body.report.substeps, 8);
      const Real n = 8 * step;
      position_error.see(
          std::abs(o.stretch() - (d0 * std::cos(n * t) + u0 * h / std::sin(t) * std::sin(n * t))) / amplitude, run);
      speed_error.see(std::abs(o.speed() - (u0 * std::cos(n * t) - d0 * std::sin(t) / h * std::sin(n * t))) /
                          (amplitude * std::sin(t) / h),
                      run);
      const Vector3 now = (2 * o.body.position(0) + 0.7 * o.body.position(1)) / 2.7;
      centre_error.see((now - centre - n * h * centre_speed).norm(), run);
    }
    ++run;
  }
  position_error.expect_below(1e-12, "stretch");
  speed_error.expect_below(1e-12, "speed");
  centre_error.expect_below(1e-13, "centre of mass");
}

TEST(TwoParticleSpring, KeepsTheEnergyOfTheDiscreteEllipse) {
  // Kinetic energy + (1 - (w h)²/4) elastic energy is exactly constant, so at u = 0 the energy is largest and it never
  // falls below 1 - (w h)²/4 of that.
  Oscillator o({0, 0, 1}, 50, 0.5, {1, 1}, 0.1, 0);
  o.body.body.options = {.substeps = 4, .energy_tolerance = 1e300};
  const Real wh = 0.9, h = wh / std::sqrt(o.omega2);
  advance(o.body, 4 * h);
  const auto shadow = [&] {
    return o.body.body.report.kinetic_energy + (1 - wh * wh / 4) * o.body.body.report.elastic_energy;
  };
  const Real start = (1 - wh * wh / 4) * 50 / 2 * 0.2 * 0.2;
  for (int step = 0; step < 500; ++step) {
    advance(o.body, 4 * h);
    ASSERT_NEAR(shadow(), start, 1e-12 * start) << "step " << step;
  }
}

TEST(PinnedSpring, SwingsAboutThePinWhichStays) {
  Oscillator o({0, 1, 0}, 10, 1, {1, 1}, 0.1, 0);
  o.body.particles().inverse_masses[0] = 0;
  estimate_stability(o.body.body);
  EXPECT_NEAR(o.body.body.largest_eigenvalue, 10, 1e-9);  // K / L0² m
  o.body.body.options = {.substeps = 1, .energy_tolerance = 1e300};
  const Real h = 0.1, t = std::acos(1 - 10 * h * h / 2);
  for (int n = 1; n <= 100; ++n) {
    advance(o.body, h);
    ASSERT_NEAR(o.stretch(), 0.1 * std::cos(n * t), 1e-13);
  }
  EXPECT_EQ(o.body.position(0), Vector3(0, 0, 0));
}

TEST(DrivenPin, MovesAtItsVelocityAndItsWorkIsNotTakenForAnError) {
  Oscillator o({1, 0, 0}, 1000, 1, {1, 1}, 0, 0);
  o.body.particles().inverse_masses[0] = 0;
  estimate_stability(o.body.body);
  o.body.set_velocity(0, {-3, 0, 0});  // the pin leaves: energy flows in from rest
  int most_retries = 0;
  Real most_energy = 0;
  for (int step = 0; step < 100; ++step) {
    advance(o.body, 0.01);
    most_retries = std::max(most_retries, o.body.body.report.retries);
    most_energy = std::max(most_energy, o.body.energy());
  }
  RecordProperty("most_retries", most_retries);
  EXPECT_NEAR(o.body.position(0).x(), -3, 1e-13);
  // The other particle follows at 3 (1 - cos wt) m/s: 18 J at most, all of it brought in by the pin.
  EXPECT_NEAR(most_energy, 18, 0.4);
  EXPECT_LE(most_retries, 3);
}

TEST(ExternalForce, GivesTheParabolaOfAConstantAcceleration) {
  // Exact for any number of substeps: x = x0 + v0 t + (g + f/m) t²/2.
  for (const int substeps : {1, 7}) {
    SCOPED_TRACE(std::to_string(substeps) + " substeps");
    Eigen::Matrix3Xd x0(3, 2);
    x0 << 1, 4, 2, 5, 3, 6;
    Body body = make_free_particles(x0, {2, 0.5});
    body.body.options.substeps = substeps;
    body.body.gravity = Vector3(0, -10, 0);
    body.body.external_forces = PackedVectors::Zero(4, 2);
    body.body.external_forces.col(0) << 4, 0, 1, 0;
    const Vector3 v0(1, -1, 0.5);
    body.set_velocity(0, v0);
    for (int step = 0; step < 64; ++step) {
      advance(body, 1.0 / 64);
      ASSERT_EQ(body.body.report.retries, 0);
    }
    EXPECT_LT((body.position(0) - (Vector3(1, 2, 3) + v0 + Vector3(2, -10, 0.5) / 2)).norm(), 1e-13);
    EXPECT_LT((body.velocity(0) - (v0 + Vector3(2, -10, 0.5))).norm(), 1e-13);
    EXPECT_LT((body.position(1) - Vector3(4, 0, 6)).norm(), 1e-13);
  }
}

TEST(ExternalForce, TakesEffectOnceThePositionsAreDeclaredChanged) {
  Body body = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {1});
  advance(body, 0.5);
  body.body.external_forces = PackedVectors::Zero(4, 1);
  body.body.external_forces(0, 0) = 8;
  body.body.positions_changed();
  advance(body, 0.5);
  EXPECT_DOUBLE_EQ(body.position(0).x(), 1);
  EXPECT_DOUBLE_EQ(body.velocity(0).x(), 4);
}

TEST(Gravity, HasNoHoldOnAPin) {
  Body body = make_free_particles(Eigen::Matrix3Xd::Zero(3, 2), {1, 1});
  body.particles().inverse_masses[0] = 0;
  body.body.gravity = Vector3(0, -10, 0);
  advance(body, 1);
  EXPECT_EQ(body.position(0), Vector3(0, 0, 0));
  EXPECT_DOUBLE_EQ(body.position(1).y(), -5);
}

TEST(Drag, IsAnExponentialDecayOfVelocity) {
  Body body = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {3});
  body.body.options.drag = 2;
  body.set_velocity(0, {5, 0, 0});
  const Real h = 0.01;
  for (int step = 0; step < 100; ++step) advance(body, h);
  const Real factor = std::exp(-2 * h);
  EXPECT_NEAR(body.velocity(0).x(), 5 * std::exp(-2.0), 1e-13);
  EXPECT_NEAR(body.position(0).x(), 5 * h * (1 - std::pow(factor, 100)) / (1 - factor), 1e-13);
  EXPECT_NEAR(body.body.report.kinetic_energy, 1.5 * 25 * std::exp(-4.0), 1e-12);
}

TEST(Damping, OfASpringRemovesItsOscillationButNotItsFlight) {
  Oscillator o({1, 1, 0}, 50, 0.5, {2, 0.7}, 0.05, 0);
  o.body.body.options.damping_time = 0.05;
  for (int i = 0; i < 2; ++i) o.body.set_velocity(i, {3, 0, 0});
  const Real flight = 2.7 * 9 / 2;
  Real last = 1e300;
  for (int step = 0; step < 300; ++step) {
    advance(o.body, 0.02);
    const Real oscillation = o.body.energy() - flight;
    // The energy of velocity Verlet itself swings by a share (w h)²/4 of the oscillation.
    ASSERT_LT(oscillation, 1.05 * last + 1e-13) << "step " << step;
    last = oscillation;
  }
  EXPECT_LT(std::abs(o.stretch()), 1e-9);
  EXPECT_NEAR(last, 0, 1e-12);
}

TEST(Step, OfNoTimeOrNoBodiesChangesNothing) {
  Oscillator o({1, 0, 0}, 50, 0.5, {1, 1}, 0.1, 0.2);
  const PackedVectors x = o.body.particles().positions;
  advance(o.body, 0);
  EXPECT_EQ(o.body.particles().positions, x);
  RigidBody rigid = make_sphere(1, 1, {0, 0, 0});
  rigid.velocity.setOnes();
  advance(std::vector<Body*>{}, 1, std::span(&rigid, 1));
  EXPECT_EQ(rigid.position, Vector3(0, 0, 0));
}

}  // namespace
}  // namespace penalty::testing
