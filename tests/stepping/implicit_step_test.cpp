#include "penalty/mesh/surface_builders.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

Body make_stretched_cube(Real stiffness) { return implicit(testing::make_stretched_cube(stiffness, 1.6)); }

/// `links` springs of 0.1 m, nodes of 2 g, hanging from a pin with 5 kg at the end.
Body make_chain(int links, Real stiffness) {
  Eigen::Matrix3Xd rest(3, links + 1);
  std::vector<Edge> edges;
  edges.reserve(links);
  for (int i = 0; i <= links; ++i) rest.col(i) = Vector3(0, -0.1 * i, 0);
  for (int i = 0; i < links; ++i) edges.push_back({i, i + 1});
  PotentialField field(rest);
  field.add<Length>(edges, stiffness);
  std::vector<Real> inverse_masses(static_cast<std::size_t>(links + 1), 1 / 0.002);
  inverse_masses.front() = 0;
  inverse_masses.back() = 1 / 5.0;
  Body chain = implicit(make_body(std::move(field), std::move(inverse_masses)));
  chain.body.gravity = Vector3(0, -9.81, 0);
  return chain;
}

TEST(ImplicitStep, OfASpringAlongItsAxisIsBackwardEulerInClosedForm) {
  // One end pinned; along the axis the force is linear in the stretch d, with damping b K = b m w²:
  //   u' = (u - w² h d) / (1 + (w h)² + b w² h),   d' = d + h u'.
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
      Body spring = implicit(make_body(std::move(field), {0, 1 / mass}));
      spring.body.options.damping_time = damping_time;
      Real d = 0.02, u = 0.3;
      spring.set_position(1, (length + d) * axis);
      spring.set_velocity(1, u * axis);
      const Real d_scale = d + u * h, u_scale = u + std::sqrt(omega2) * d;
      for (int step = 0; step < 20; ++step) {
        advance(spring, h);
        EXPECT_EQ(spring.body.report.integrator, Integrator::implicit_step);
        EXPECT_EQ(spring.body.report.substeps, 1);
        u = (u - omega2 * h * d) / (1 + wh * wh + damping_time * omega2 * h);
        d += h * u;
        stretch.see(std::abs(axis.dot(spring.position(1)) - length - d) / d_scale, run);
        speed.see(std::abs(axis.dot(spring.velocity(1)) - u) / u_scale, run);
      }
      ++run;
    }
  // Newton's iterations end at a thousandth of the force that was not balanced.
  stretch.expect_below(1e-3, "stretch");
  speed.expect_below(1e-3, "speed");
}

TEST(ImplicitStep, LetsAHangingChainHangStraight) {
  // 5 kg below nodes of 2 g: along the chain it is stiff, across it only tension holds, which a stiffness without the
  // second derivative of the length does not know.
  Random random(1);
  for (const Real stiffness : {1e2, 1e4, 1e6}) {
    SCOPED_TRACE("K " + std::to_string(stiffness));
    Body chain = make_chain(20, stiffness);
    for (int i = 1; i < chain.particles().size(); ++i)
      chain.set_position(i, chain.position(i) + Vector3(random.uniform(-1e-4, 1e-4), 0, random.uniform(-1e-4, 1e-4)));
    Real farthest = 0;
    for (int step = 0; step < 300; ++step) {
      advance(chain, 1.0 / 60);
      ASSERT_TRUE(chain.body.report.finite);
      for (int i = 0; i < chain.particles().size(); ++i)
        farthest = std::max(farthest, std::hypot(chain.position(i).x(), chain.position(i).z()));
    }
    RecordProperty("farthest_" + std::to_string(static_cast<int>(std::log10(stiffness))), std::to_string(farthest));
    EXPECT_LT(farthest, 1e-3);
    // All springs carry the weight m g: each is longer by m g L0² / K, but for that of the nodes.
    const Real drop = -chain.position(20).y() - 2, expected = 20 * 5 * 9.81 * 0.01 / stiffness;
    EXPECT_NEAR(drop, expected, 0.01 * expected);
  }
}

TEST(ImplicitStep, NeverGainsEnergyInFreeFlightAndKeepsMomenta) {
  WorstError linear, angular;
  for (const Real rate : {30.0, 60.0, 240.0})
    for (const Real stiffness : {1e-2, 1e2, 1e5, 1e8}) {
      SCOPED_TRACE("rate " + std::to_string(rate) + ", K " + std::to_string(stiffness));
      Body cube = make_stretched_cube(stiffness);
      const Momentum before = momentum({&cube});
      const Real start = cube.field->energy(cube.particles().positions) + kinetic_energy(cube.particles());
      Real largest = 0;
      for (int step = 0; step < 20; ++step) {
        advance(cube, 1 / rate);
        ASSERT_TRUE(cube.body.report.finite);
        largest = std::max(largest, cube.energy());
      }
      EXPECT_LE(largest, start);
      const Momentum after = momentum({&cube});
      linear.see((after.linear - before.linear).norm() / before.linear.norm(), static_cast<unsigned>(rate));
      angular.see((after.angular - before.angular).norm() / before.angular.norm(), static_cast<unsigned>(rate));
    }
  linear.expect_below(1e-12, "linear momentum");
  angular.expect_below(1e-12, "angular momentum");
}

TEST(ImplicitStep, KeepsMomentaWhenItsIterationsEndTooEarly) {
  Body cube = make_stretched_cube(1e6);
  cube.body.options.newton_iterations = 1;
  cube.body.options.linear = {2, 0.5};
  const Momentum before = momentum({&cube});
  const Real start = cube.field->energy(cube.particles().positions) + kinetic_energy(cube.particles());
  for (int step = 0; step < 60; ++step) {
    advance(cube, 1.0 / 60);
    ASSERT_LE(cube.energy(), start * (1 + 1e-12));
  }
  const Momentum after = momentum({&cube});
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angular.norm());
}

TEST(ImplicitStep, FallsAsGravityAndForcesSay) {
  // x'' = g + F/m, by backward Euler: v_n = n h a, x_n = h² a n (n + 1) / 2.
  Body cube = make_stretched_cube(100);
  cube.particles().positions = cube.field->rest_positions();
  cube.particles().velocities.setZero();
  cube.body.gravity = Vector3(0.5, -9.81, 0);
  cube.body.external_forces = PackedVectors::Zero(4, cube.particles().size());
  cube.body.external_forces.row(2).setConstant(0.25);  // on each of 125 particles of 8 g
  const Vector3 a(0.5, -9.81, 0.25 * 125);
  for (int step = 0; step < 30; ++step) advance(cube, 1.0 / 60);
  const Real h = 1.0 / 60;
  for (int i = 0; i < cube.particles().size(); ++i) {
    EXPECT_LT((cube.velocity(i) - 30 * h * a).norm(), 1e-11);
    EXPECT_LT((cube.position(i) - cube.field->rest_positions().col(i).head<3>() - h * h * a * 30 * 31 / 2).norm(),
              1e-11);
  }
  EXPECT_NEAR(cube.body.flows.constant_forces, a.squaredNorm() * h * h * 30 * 31 / 2, 1e-9);
}

TEST(ImplicitStep, ConvergesToTheExplicitOneWithTheRate) {
  // A tenth of a second of a soft body: the error is of first order.
  const auto run = [](bool is_implicit, int rate) {
    Body cube = make_stretched_cube(0.05);
    if (!is_implicit) cube.body.options = {.integrator = Integrator::explicit_step, .substeps = 40};
    cube.body.options.newton_tolerance = 1e-8;
    for (int step = 0; step < rate / 10; ++step) advance(cube, 1.0 / rate);
    return cube.particles().positions;
  };
  const PackedVectors exact = run(false, 60);
  const Real coarse = (run(true, 240) - exact).norm(), fine = (run(true, 960) - exact).norm();
  EXPECT_GT(coarse, 0);
  EXPECT_NEAR(coarse / fine, 4, 0.6);
}

TEST(ImplicitStep, PinnedParticlesStayAndDrivenOnesMove) {
  Body beam = implicit(make_beam_body(2));
  beam.body.gravity = Vector3(0, -9.81, 0);
  const Vector3 velocity(0, 0.3, 0);
  std::vector<int> pinned;
  for (int i = 0; i < beam.particles().size(); ++i)
    if (beam.position(i).x() == 0) {
      beam.particles().inverse_masses[i] = 0;
      beam.set_velocity(i, velocity);
      pinned.push_back(i);
    }
  ASSERT_GT(pinned.size(), 4u);
  const PackedVectors start = beam.particles().positions;
  for (int step = 0; step < 60; ++step) advance(beam, 1.0 / 60);
  for (const int i : pinned) {
    EXPECT_LT((beam.position(i) - start.col(i).head<3>() - velocity).norm(), 1e-13);
    EXPECT_EQ(beam.velocity(i), velocity);
  }
  EXPECT_GT(beam.body.flows.driving, 0) << "who lifts it works against its weight";
}

// The three things that a step sets after its minimum was found are not to be tested where they were set; what they
// took is, and that it vanishes.

TEST(ImplicitStep, GivesBackNoLinearMomentumWhenNewtonConverges) {
  Body loose = make_stretched_cube(1e4), tight = converged(make_stretched_cube(1e4));
  loose.body.options.newton_iterations = 1;
  loose.body.options.linear = {2, 0.5};
  const Real momentum_scale = momentum({&loose}).linear.norm();
  advance(loose, 1.0 / 60);
  advance(tight, 1.0 / 60);
  EXPECT_GT(loose.body.report.restored_momentum, 1e-6 * momentum_scale) << "nothing to restore: the test shows nothing";
  EXPECT_LT(tight.body.report.restored_momentum, 1e-9 * momentum_scale);
}

TEST(ImplicitStep, GivesBackTheSpinThatBackwardEulerTakesAndNoMore) {
  // L' - L = h sum m v' x v, about the centre of mass, where Newton's iterations converge: of second order in h.
  const auto restored = [](int rate) {
    Body cube = converged(make_stretched_cube(1));
    const std::vector<Vector3> before = [&] {
      std::vector<Vector3> v;
      v.reserve(cube.particles().size());
      for (int i = 0; i < cube.particles().size(); ++i) v.push_back(cube.velocity(i));
      return v;
    }();
    const PackedVectors start = cube.particles().positions;
    advance(cube, 1.0 / rate);
    Vector3 taken = Vector3::Zero();
    // What was restored is a turn of the velocities only: the positions are those of backward Euler.
    for (int i = 0; i < cube.particles().size(); ++i) {
      const Vector3 v = (cube.particles().positions - start).col(i).head<3>() * rate;
      taken += v.cross(before[i]) / cube.particles().inverse_masses[i] / rate;
    }
    EXPECT_NEAR(cube.body.report.restored_spin, taken.norm(), 1e-6 * taken.norm()) << rate << " Hz";
    return cube.body.report.restored_spin;
  };
  const Real coarse = restored(960), fine = restored(3840);
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(coarse / fine, 16, 2);
}

TEST(ImplicitStep, CapsNoEnergyOfABodyThatDoesNotTurnWhenNewtonConverges) {
  for (const Real stiffness : {1.0, 1e4, 1e8}) {
    Body cube = converged(make_stretched_cube(stiffness));
    cube.particles().velocities.setZero();
    Real start = 0;
    for (int step = 0; step < 10; ++step) {
      advance(cube, 1.0 / 60);
      if (step == 0) start = cube.energy() + cube.body.flows.lost() - cube.body.flows.received();
      EXPECT_LE(cube.body.report.capped_energy, 1e-12 * start) << "K " << stiffness << ", step " << step;
    }
  }
}

TEST(ImplicitStep, BooksWhatCanBeMeasuredOtherwise) {
  // Integration closes the books by definition, so the balance says nothing. What gravity gives, drag takes and what is
  // lost to the method are known from elsewhere.
  const auto run = [](int rate, Real damping_time) {
    Body cube = converged(make_stretched_cube(0.05));
    cube.body.gravity = Vector3(0, -9.81, 0);
    cube.body.options.damping_time = damping_time;
    const auto height = [&] {
      Real sum = 0;
      for (int i = 0; i < cube.particles().size(); ++i)
        sum += cube.position(i).y() / cube.particles().inverse_masses[i];
      return sum;
    };
    const Real before = height();
    for (int step = 0; step < rate / 10; ++step) advance(cube, 1.0 / rate);
    EXPECT_NEAR(cube.body.flows.constant_forces, 9.81 * (before - height()), 1e-9);
    return cube.body.flows;
  };
  const EnergyFlows coarse = run(240, 0), fine = run(960, 0), damped = run(960, 0.01), more = run(960, 0.02);
  EXPECT_EQ(coarse.damping, 0);
  EXPECT_GT(fine.integration, 0);
  EXPECT_NEAR(coarse.integration / fine.integration, 4, 0.8) << "numerical damping is of first order";
  EXPECT_GT(damped.damping, 2 * damped.integration);
  EXPECT_GT(more.damping, damped.damping);
}

TEST(ImplicitStep, DragTakesItsShareOfTheKineticEnergy) {
  Body cube = make_stretched_cube(10);
  cube.particles().positions = cube.field->rest_positions();
  for (int i = 0; i < cube.particles().size(); ++i) cube.set_velocity(i, {1, 2, 3});
  cube.body.options.drag = 0.5;
  for (int step = 0; step < 60; ++step) advance(cube, 1.0 / 60);
  EXPECT_NEAR(cube.body.flows.drag, 7 * (1 - std::exp(-2 * 0.5)), 1e-9);  // of 1 kg at 14 m²/s²
}

TEST(ImplicitStep, StiffElementsOfManyPointsConverge) {
  // A sheet of springs and the volume that it encloses: stiffness that couples every particle with every other.
  const TriangleSurface sphere = penalty::make_sphere(0.5, 2);
  PotentialField field(sphere.vertices);
  field.add<Length>(edges_of(sphere.triangles), 10);
  std::vector<std::vector<int>> everyone(1);
  for (int i = 0; i < sphere.vertices.cols(); ++i) everyone[0].push_back(i);
  field.add(EnclosedVolume(sphere.triangles), everyone, 1e4);
  const auto count = static_cast<std::size_t>(sphere.vertices.cols());
  Body ball = implicit(make_body(std::move(field), std::vector<Real>(count, static_cast<Real>(count))));
  ball.field->find<EnclosedVolume>()->set_target(0, 0.5);
  ball.body.positions_changed();
  for (int step = 0; step < 120; ++step) {
    advance(ball, 1.0 / 60);
    ASSERT_TRUE(ball.body.report.finite);
  }
  const std::vector<Real> strains = penalty::strains(*ball.field, ball.particles().positions);
  EXPECT_LT(std::abs(strains.back()), 0.01) << "the volume has nearly reached its target of 1.5 times";
  EXPECT_LT(kinetic_energy(ball.particles()), 1e-9);
}

TEST(ImplicitStep, DampingOfABodyThatTurnsNeedsNoMoreSubstepsThanNone) {
  // What damping would take on the straight way of particles that turn is more than it does take, as spin is kept.
  for (const Real spin : {3.0, 10.0, 30.0}) {
    SCOPED_TRACE("spin " + std::to_string(spin));
    const auto substeps_with = [&](Real damping_time) {
      Body beam = implicit(make_beam_body(4));
      beam.body.options.damping_time = damping_time;
      const Vector3 center = beam.particles().positions.topRows<3>().rowwise().mean();
      for (int i = 0; i < beam.particles().size(); ++i)
        beam.set_velocity(i, Vector3(0, 0, spin).cross(beam.position(i) - center));
      const Momentum before = momentum({&beam});
      Real last = kinetic_energy(beam.particles());
      int substeps = 0;
      for (int step = 0; step < 120; ++step) {
        advance(beam, frame);
        substeps += beam.body.report.substeps;
        EXPECT_LE(beam.energy(), last * (1 + 1e-11)) << "step " << step;
        last = beam.energy();
      }
      EXPECT_LT((momentum({&beam}).angular - before.angular).norm(), 1e-12 * before.angular.norm());
      return substeps;
    };
    const int without = substeps_with(0);
    for (const Real damping_time : {0.01, 0.1}) EXPECT_LT(substeps_with(damping_time), 1.5 * without);
  }
}

TEST(ImplicitStep, AutomaticChoosesByTheSubstepsThatItWouldTake) {
  Body cube = make_stretched_cube(1);
  cube.body.options.integrator = Integrator::automatic;
  const auto used_at = [&](Real substeps, int order = 1) {
    const Real duration = 2 * 0.99 * substeps / std::sqrt(cube.body.largest_eigenvalue);
    Body copy = make_stretched_cube(1);
    copy.body.options.integrator = Integrator::automatic;
    copy.body.options.implicit_order = order;
    advance(copy, duration);
    return copy.body.report.integrator;
  };
  EXPECT_EQ(used_at(0.9 * crossover_substeps), Integrator::explicit_step);
  EXPECT_EQ(used_at(1.1 * crossover_substeps), Integrator::implicit_step);
  EXPECT_EQ(used_at(1.9 * crossover_substeps, 2), Integrator::explicit_step);
  EXPECT_EQ(used_at(2.1 * crossover_substeps, 2), Integrator::implicit_step);
  cube.body.options.substeps = 7;  // who names a number of substeps wants them
  advance(cube, 1000);
  EXPECT_EQ(cube.body.report.integrator, Integrator::explicit_step);
}

TEST(ImplicitStep, UndoesAStepThatCannotBeFinite) {
  Body cube = make_stretched_cube(1);
  cube.set_velocity(3, Vector3(std::nan(""), 0, 0));
  const PackedVectors before = cube.particles().positions;
  advance(cube, 1.0 / 60);
  EXPECT_FALSE(cube.body.report.finite);
  EXPECT_EQ(cube.body.report.first_bad_particle, 3);
  EXPECT_EQ(cube.particles().positions, before);
}

TEST(ImplicitStep, UnfoldsWhatLiesInALine) {
  // A line is a state that no force leads out of.
  const TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  for (const bool unfold : {false, true}) {
    Body cube = implicit(
        make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.poisson = 0}, ElasticModel::neo_hookean),
                  std::vector<Real>(static_cast<std::size_t>(mesh.vertices.cols()), 27)));
    cube.body.options.unfold = unfold;
    cube.particles().positions.topRows<2>().setZero();
    cube.body.positions_changed();
    bool unfolded = false;
    for (int step = 0; step < 120; ++step) {
      advance(cube, 1.0 / 60);
      unfolded = unfolded || cube.body.report.unfolded;
    }
    EXPECT_EQ(unfolded, unfold);
    const Real energy = cube.field->energy(cube.particles().positions);
    if (unfold)
      EXPECT_LT(energy, 1e-6);
    else
      EXPECT_GT(energy, 1);
  }
}

TEST(ImplicitStep, OfAFlatSheetLeavesItFlat) {
  const TriangleSurface sheet = make_sheet(1, 1, 4, 4);
  PotentialField field(sheet.vertices);
  field.add<Length>(edges_of(sheet.triangles), 1);
  const auto count = static_cast<std::size_t>(sheet.vertices.cols());
  Body cloth = implicit(make_body(std::move(field), std::vector<Real>(count, 25)));
  advance(cloth, 1.0 / 60);
  EXPECT_FALSE(cloth.body.report.unfolded) << "it is flat at rest";
}

}  // namespace
}  // namespace penalty::testing
