#include <numbers>

#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

Body second_order(Body body) {
  body.body.options.implicit_order = 2;
  body.body.options.settling_speed = 0;
  return implicit(std::move(body));
}

Body make_pulled_cube(Real stiffness) { return second_order(make_stretched_cube(stiffness, 1.3)); }

/// A bar of 4 x 1 x 1 m, 4000 kg, that is clamped at one end and leaves its shape at rest nearly in its first mode.
Body make_clamped_bar(Real stiffness) {
  const TetMesh mesh = make_box({4, 1, 1}, {12, 3, 3});
  const auto count = mesh.vertices.cols();
  const Real root = mesh.vertices.row(0).minCoeff();
  std::vector<Real> inverse_masses(static_cast<std::size_t>(count), static_cast<Real>(count) / 4000);
  for (int i = 0; i < count; ++i)
    if (mesh.vertices(0, i) == root) inverse_masses[i] = 0;
  Body bar = second_order(make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness), inverse_masses));
  for (int i = 0; i < count; ++i) {
    const Real share = (mesh.vertices(0, i) - root) / 4;
    if (inverse_masses[i] > 0) bar.set_velocity(i, Vector3(0, 0.2 * share * share, 0));
  }
  return bar;
}

struct Oscillation {
  Real period = 0, kept = 0;  // [s]; amplitude of the tenth period by that of the first
};

/// Of the height of the last particle over ten periods.
Oscillation oscillation(Body& bar, int rate) {
  const int tip = bar.particles().size() - 1;
  const Real rest = bar.field->rest_positions()(1, tip);
  std::vector<Real> crossings, peaks;
  Real last = 0, peak = 0;
  for (int step = 0; crossings.size() < 21 && step < 40 * rate; ++step) {
    advance(bar, 1.0 / rate);
    const Real height = bar.position(tip).y() - rest;
    peak = std::max(peak, std::abs(height));
    if (step > 0 && (height < 0) != (last < 0)) {
      crossings.push_back((step + last / (last - height)) / rate);
      peaks.push_back(peak);
      peak = 0;
    }
    last = height;
  }
  if (crossings.size() < 21) return {};
  return {(crossings.back() - crossings.front()) / 10, std::max(peaks[20], peaks[19]) / std::max(peaks[1], peaks[2])};
}

TEST(TrBdf2, OfASpringAlongItsAxisIsTheRationalFunctionOfItsStages) {
  // One end pinned; u and d are the speed and the stretch, w² the stiffness by the mass, b w² the damping.
  WorstError stretch, speed;
  unsigned run = 0;
  for (const Real wh : {0.1, 1.0, 30.0})
    for (const Real damping_time : {0.0, 0.05}) {
      const Real length = 0.5, mass = 2, stiffness = 50, omega2 = stiffness / (length * length) / mass;
      const Real h = wh / std::sqrt(omega2);
      const Vector3 axis = Vector3(1, 2, -2) / 3;
      Eigen::Matrix3Xd rest(3, 2);
      rest << Vector3::Zero(), length * axis;
      PotentialField field(rest);
      const std::vector<Edge> edge{{0, 1}};
      field.add<Length>(edge, stiffness);
      Body spring = converged(second_order(make_body(std::move(field), {0, 1 / mass})));
      spring.body.options.damping_time = damping_time;
      Real d = 0.02, u = 0.3 / std::max<Real>(1, wh);  // so that it does not turn over
      spring.set_position(1, (length + d) * axis);
      spring.set_velocity(1, u * axis);
      const Real d_scale = d + u * h, u_scale = u + std::sqrt(omega2) * d;
      const Real t = h * (1 - 1 / std::numbers::sqrt2), p = 0.5 + 1 / std::numbers::sqrt2, q = p - 1;
      for (int step = 0; step < 20; ++step) {
        advance(spring, h);
        EXPECT_EQ(spring.body.report.substeps, 1);
        const Real base1 = d + t * u;
        const Real u1 = (u - t * omega2 * (d + base1)) / (1 + t * t * omega2 + 2 * t * damping_time * omega2);
        const Real d1 = base1 + t * u1, base2 = p * d1 - q * d;
        u = (p * u1 - q * u - t * omega2 * base2) / (1 + t * t * omega2 + t * damping_time * omega2);
        d = base2 + t * u;
        stretch.see(std::abs(axis.dot(spring.position(1)) - length - d) / d_scale, run);
        speed.see(std::abs(axis.dot(spring.velocity(1)) - u) / u_scale, run);
      }
      ++run;
    }
  stretch.expect_below(1e-9, "stretch");
  speed.expect_below(1e-9, "speed");
}

TEST(TrBdf2, ConvergesToTheExplicitOneWithTheSquareOfTheRate) {
  const auto run = [](Integrator integrator, int rate) {
    Body cube = converged(make_pulled_cube(0.05));
    cube.body.options.integrator = integrator;
    cube.body.options.substeps = 40;
    for (int step = 0; step < rate / 10; ++step) advance(cube, 1.0 / rate);
    return cube.particles().positions;
  };
  const PackedVectors exact = run(Integrator::explicit_step, 240);
  const Real coarse = (run(Integrator::implicit_step, 60) - exact).norm(),
             fine = (run(Integrator::implicit_step, 240) - exact).norm();
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(coarse / fine, 16, 3);
}

TEST(TrBdf2, AClampedBarKeepsItsFrequencyAndAmplitude) {
  // 58 steps a period, and 18.
  for (const auto& [stiffness, error, kept] : {std::tuple{6e4, 0.001, 0.95}, {6e5, 0.007, 0.95}}) {
    SCOPED_TRACE(stiffness);
    Body exact = make_clamped_bar(stiffness), bar = make_clamped_bar(stiffness),
         first_order = make_clamped_bar(stiffness);
    exact.body.options.integrator = Integrator::explicit_step;
    first_order.body.options.implicit_order = 1;
    const Oscillation of_exact = oscillation(exact, 960), of_bar = oscillation(bar, 60);
    EXPECT_NEAR(of_exact.kept, 1, 0.02);
    EXPECT_NEAR(of_bar.period / of_exact.period, 1, error);
    EXPECT_GT(of_bar.kept, kept);
    EXPECT_LT(of_bar.kept, 1.001);
    EXPECT_LT(oscillation(first_order, 60).kept, 0.2);
  }
}

TEST(TrBdf2, DampsAsTheExplicitOneDoes) {
  Body exact = make_clamped_bar(6e4), bar = make_clamped_bar(6e4);
  exact.body.options.integrator = Integrator::explicit_step;
  for (Body* body : {&exact, &bar}) body->body.options.damping_time = 0.005;
  const Oscillation of_exact = oscillation(exact, 960), of_bar = oscillation(bar, 60);
  EXPECT_LT(of_exact.kept, 0.6);
  EXPECT_NEAR(of_bar.kept, of_exact.kept, 0.01);
  EXPECT_NEAR(bar.body.flows.damping, exact.body.flows.damping, 0.03 * exact.body.flows.damping);
}

TEST(TrBdf2, NeverGainsEnergyInFreeFlightAndKeepsMomenta) {
  WorstError linear, angular;
  for (const Real rate : {30.0, 60.0, 240.0})
    for (const Real stiffness : {1e-2, 1e2, 1e5, 1e8}) {
      SCOPED_TRACE("rate " + std::to_string(rate) + ", K " + std::to_string(stiffness));
      Body cube = make_pulled_cube(stiffness);
      const Momentum before = momentum({&cube});
      const Real start = cube.field->energy(cube.particles().positions) + kinetic_energy(cube.particles());
      for (int step = 0; step < 20; ++step) {
        advance(cube, 1 / rate);
        ASSERT_TRUE(cube.body.report.finite);
        EXPECT_LE(cube.energy(), start);
      }
      const Momentum after = momentum({&cube});
      linear.see((after.linear - before.linear).norm() / before.linear.norm(), static_cast<unsigned>(rate));
      angular.see((after.angular - before.angular).norm() / before.angular.norm(), static_cast<unsigned>(rate));
    }
  linear.expect_below(1e-12, "linear momentum");
  angular.expect_below(1e-12, "angular momentum");
}

TEST(TrBdf2, FallsAlongTheParabola) {
  Body cube = make_pulled_cube(100);
  cube.particles().positions = cube.field->rest_positions();
  cube.particles().velocities.setZero();
  cube.body.gravity = Vector3(0.5, -9.81, 0);
  cube.body.external_forces = PackedVectors::Zero(4, cube.particles().size());
  cube.body.external_forces.row(2).setConstant(0.25);  // on each of 125 particles of 8 g
  const Vector3 a(0.5, -9.81, 0.25 * 125);
  for (int step = 0; step < 30; ++step) advance(cube, frame);
  const Real t = 30 * frame;
  for (int i = 0; i < cube.particles().size(); ++i) {
    EXPECT_LT((cube.velocity(i) - t * a).norm(), 1e-11);
    EXPECT_LT((cube.position(i) - cube.field->rest_positions().col(i).head<3>() - t * t / 2 * a).norm(), 1e-11);
  }
}

TEST(TrBdf2, HangsOnASpringFromTheWorldAsItWouldInSmallSteps) {
  // Free, but not alone: its momenta are what the spring to a fixed point gives them.
  const auto run = [](Integrator integrator, int rate) {
    Body cube = converged(make_pulled_cube(10));
    cube.particles().positions = cube.field->rest_positions();
    const std::vector<std::array<int, 1>> corner{{124}};
    cube.field->add(Distance::pinned(cube.position(124) + Vector3(0.1, 0.2, 0), 1), corner, 20.0);
    cube.body.gravity = Vector3(0, -9.81, 0);
    cube.body.positions_changed();
    cube.body.options.integrator = integrator;
    cube.body.options.substeps = 40;
    for (int step = 0; step < rate / 4; ++step) advance(cube, 1.0 / rate);
    return momentum({&cube});
  };
  const Momentum exact = run(Integrator::explicit_step, 240), coarse = run(Integrator::implicit_step, 60),
                 fine = run(Integrator::implicit_step, 240);
  EXPECT_NEAR((coarse.linear - exact.linear).norm() / (fine.linear - exact.linear).norm(), 16, 5);
  EXPECT_NEAR((coarse.angular - exact.angular).norm() / (fine.angular - exact.angular).norm(), 16, 5);
}

TEST(TrBdf2, WhoDrivesAPinnedEndPaysForWhatTheBodyGets) {
  Body bar = converged(make_clamped_bar(6e4));
  bar.particles().velocities.setZero();
  std::vector<int> pinned;
  for (int i = 0; i < bar.particles().size(); ++i)
    if (bar.particles().inverse_masses[i] == 0) {
      pinned.push_back(i);
      bar.set_velocity(i, {0, 0.3, 0});
    }
  const PackedVectors start = bar.particles().positions;
  for (int step = 0; step < 60; ++step) advance(bar, frame);
  for (const int i : pinned) {
    EXPECT_LT((bar.position(i) - start.col(i).head<3>() - Vector3(0, 0.3, 0)).norm(), 1e-13);
    EXPECT_EQ(bar.velocity(i), Vector3(0, 0.3, 0));
  }
  Real moving = 0;  // [J] of what is not driven
  for (int i = 0; i < bar.particles().size(); ++i)
    if (bar.particles().inverse_masses[i] > 0)
      moving += bar.velocity(i).squaredNorm() / bar.particles().inverse_masses[i] / 2;
  const Real has = bar.field->energy(bar.particles().positions) + moving;
  EXPECT_GT(has, 50);
  EXPECT_NEAR(bar.body.flows.driving, has, 0.05 * has);
}

TEST(TrBdf2, IsBackwardEulerWhereSomethingLies) {
  const auto run = [](int order) {
    SurfaceBodies bodies;
    bodies.integrator = Integrator::implicit_step;
    bodies.gravity = Vector3(0, -9.81, 0);
    bodies.floors = {0};
    Body& box = bodies.add(make_box({1, 1, 1}, {3, 3, 3}), 100.0, 1, {.shift = Vector3(0, 0.006, 0)});
    box.body.options.implicit_order = order;
    bodies.step(frame, 20);
    return box.particles().positions;
  };
  EXPECT_EQ(run(1), run(2));
}

TEST(TrBdf2, ABallReboundsAtSixtyHertzAsItDoesInSmallSteps) {
  for (const Real young : {1e6, 1e7}) {
    SCOPED_TRACE(young);
    const auto rebound = [young](Integrator integrator, int order, int rate) {
      SurfaceBodies bodies;
      bodies.integrator = integrator;
      bodies.gravity = Vector3(0, -g, 0);
      bodies.floors = {0};
      Body& ball = bodies.add(make_ball(0.3, 4), Material{.young = young, .poisson = 0.3}, 113,
                              {.shift = Vector3(0, 0.5, 0), .velocity = Vector3(0, -6, 0)});
      ball.body.options.implicit_order = order;
      const Real energy = bodies.energy();
      Real fastest = 0;
      for (int step = 0; step < rate / 2; ++step) {
        bodies.step(1.0 / rate);
        fastest = std::max(fastest, momentum({&ball}).linear.y() / 113);
        EXPECT_LE(bodies.energy(), energy * 1.001);
      }
      return fastest / std::sqrt(36 + 2 * g * 0.2);
    };
    const Real exact = rebound(Integrator::explicit_step, 1, 960), second = rebound(Integrator::implicit_step, 2, 60);
    EXPECT_GT(second, 0.8);
    EXPECT_NEAR(second, exact, 0.03);
    EXPECT_LT(rebound(Integrator::implicit_step, 1, 60), 0.5);
  }
}

TEST(TrBdf2, BodiesThatFlyAtEachOtherDoNotCross) {
  SurfaceBodies bodies;
  bodies.integrator = Integrator::implicit_step;
  for (const Real side : {-1.0, 1.0})
    bodies
        .add(make_box({1, 1, 1}, {3, 3, 3}), 100.0, 1,
             {.shift = Vector3(2 * side, 0.1 * side, 0), .velocity = Vector3(-10 * side, 0, 0)})
        .body.options.implicit_order = 2;
  const Momentum before = bodies.momentum();
  const Real start = bodies.energy();
  for (int step = 0; step < 30; ++step) {
    bodies.step();
    EXPECT_EQ(bodies.crossings(), 0);
    EXPECT_LE(bodies.energy(), start * (1 + 1e-9));
  }
  EXPECT_LT((bodies.momentum().linear - before.linear).norm(), 1e-10);
  EXPECT_LT((bodies.momentum().angular - before.angular).norm(), 1e-10);
  EXPECT_LT(bodies.kinetic_energy(), 0.99 * start) << "they have not met";
}

}  // namespace
}  // namespace penalty::testing
