// Potentials over points of several bodies, rigid ones included.
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

Coupling make_coupling(PotentialField& field, std::vector<Side> points) {
  Coupling coupling;
  coupling.points = std::move(points);
  coupling.field = &field;
  return coupling;
}

Side particle(int body, int i) { return Side::of_particles(body, WeightedPoint::at_particle(i)); }
Side on_rigid(int rigid, const Vector3& anchor = Vector3::Zero()) { return Side::of_rigid(rigid, anchor); }

// Two beams of different material, end to end, and a sphere that hangs on the second by two points.
struct Train {
  Body first = make_beam_body(1), second = make_beam_body(1, {.young = 1e5, .poisson = 0.3});
  RigidBody sphere = make_sphere(300, 0.5, {9, 0.5, 0.5});
  std::unique_ptr<PotentialField> field;
  Coupling coupling;

  Train() {
    std::vector<Side> points;
    Eigen::Matrix3Xd rest(3, 0);
    const auto add = [&](const Side& point, const Vector3& position) {
      points.push_back(point);
      rest.conservativeResize(3, rest.cols() + 1);
      rest.col(rest.cols() - 1) = position;
      return static_cast<int>(rest.cols()) - 1;
    };
    for (int i = 0; i < second.particles().size(); ++i) second.set_position(i, second.position(i) + Vector3(4, 0, 0));
    std::vector<Edge> ties, ropes;
    for (int i = 0; i < first.particles().size(); ++i)
      for (int j = 0; j < second.particles().size(); ++j)
        if ((first.position(i) - second.position(j)).norm() < 1e-9)
          ties.push_back({add(particle(0, i), first.position(i)), add(particle(1, j), second.position(j))});
    const int left = add(on_rigid(0, {-0.5, 0, 0}), {8.5, 0.5, 0.5});
    const int top = add(on_rigid(0, {0, 0.5, 0}), {9, 1, 0.5});
    for (int j = 0; j < second.particles().size(); ++j)
      if (second.position(j).x() > 7.999) {
        const int end = add(particle(1, j), second.position(j));
        ropes.push_back({end, left});
        ropes.push_back({end, top});
      }
    field = std::make_unique<PotentialField>(rest);
    field->add(Attachment::of_length(1), ties, 2e5);
    field->add<Length>(ropes, 5e4);
    coupling = make_coupling(*field, std::move(points));
  }
};

TEST(Coupling, OfSoftAndRigidBodiesKeepsBothMomenta) {
  Train train;
  ASSERT_EQ(train.field->potentials()[0]->num_elements(), 4u);
  Random random(7);
  for (Body* body : {&train.first, &train.second}) {
    body->body.options.damping_time = 0.002;
    for (int i = 0; i < body->particles().size(); ++i) body->set_velocity(i, random.vector(2));
  }
  train.coupling.damping_time = 0.01;
  train.sphere.velocity = {1, -2, 0.5};
  train.sphere.angular_velocity = {0.5, 1, -2};
  RigidBody bodies[] = {train.sphere};
  const Momentum before = momentum({&train.first, &train.second}, bodies);
  Real linear_scale = 0, angular_scale = 0;
  for (int i = 0; i < train.first.particles().size(); ++i) {
    linear_scale += train.first.velocity(i).norm() / train.first.particles().inverse_masses[i];
    angular_scale += train.first.velocity(i).norm() / train.first.particles().inverse_masses[i] * 8;
  }
  for (int step = 0; step < 60; ++step) advance({&train.first, &train.second}, 1.0 / 60, bodies, {&train.coupling});
  const Momentum after = momentum({&train.first, &train.second}, bodies);
  EXPECT_LT((after.linear - before.linear).norm() / linear_scale, 1e-13);
  EXPECT_LT((after.angular - before.angular).norm() / angular_scale, 1e-13);
  EXPECT_GT((bodies[0].velocity - train.sphere.velocity).norm(), 0.1) << "the sphere felt nothing";
  EXPECT_GT((bodies[0].angular_velocity - train.sphere.angular_velocity).norm(), 0.01);
  EXPECT_GT(bodies[0].impulse.norm(), 1);
}

TEST(Coupling, KeepsEnergyWithoutDamping) {
  Train train;
  for (Body* body : {&train.first, &train.second}) body->body.options.safety = 0.2;
  RigidBody bodies[] = {train.sphere};
  bodies[0].velocity = {3, 1, 0};
  const auto total = [&] {
    return train.first.energy() + train.second.energy() + train.coupling.elastic_energy +
           bodies[0].velocity.squaredNorm() * 300 / 2 +
           bodies[0].angular_velocity.dot(bodies[0].inverse_inertia.inverse() * bodies[0].angular_velocity) / 2;
  };
  const Real before = 150 * bodies[0].velocity.squaredNorm();
  Real worst = 0;
  for (int step = 0; step < 120; ++step) {
    advance({&train.first, &train.second}, 1.0 / 120, bodies, {&train.coupling});
    worst = std::max(worst, std::abs(total() - before) / before);
  }
  EXPECT_GT(train.first.energy(), 1);
  EXPECT_LT(worst, 0.01);
}

TEST(Coupling, DampingOnlyTakesEnergy) {
  Train train;
  train.coupling.damping_time = 10;  // stiff: far beyond what an explicit damper could do
  RigidBody bodies[] = {train.sphere};
  bodies[0].velocity = {0, 2, 0};
  bodies[0].angular_velocity = {3, 0, 4};
  const auto total = [&] {
    return train.first.energy() + train.second.energy() + train.coupling.elastic_energy +
           bodies[0].velocity.squaredNorm() * 300 / 2 +
           bodies[0].angular_velocity.dot(bodies[0].inverse_inertia.inverse() * bodies[0].angular_velocity) / 2;
  };
  Real least = 1e300;
  const Real start = 150 * 4 + 0.5 * 25 * 0.4 * 300 * 0.25;
  for (int step = 0; step < 60; ++step) {
    advance({&train.first, &train.second}, 1.0 / 60, bodies, {&train.coupling});
    EXPECT_LT(total(), least + 0.005 * start) << "step " << step;
    least = std::min(least, total());
  }
  EXPECT_LT(least, 0.9 * start);
}

TEST(Coupling, AParticleOnARigidBodySwingsAtTheFrequencyOfTheReducedMass) {
  // Particle m and a free sphere M, tied by K / L² at its centre: w² = K / L² (1/m + 1/M).
  Eigen::Matrix3Xd rest(3, 1);
  rest << Vector3(0, 0, 0);
  Body body = make_free_particles(rest, {2});
  body.body.options.substeps = 64;
  body.set_position(0, {0.1, 0, 0});
  RigidBody bodies[] = {make_sphere(5, 0.3, {0, 0, 0})};
  PotentialField field(Eigen::Matrix3Xd::Zero(3, 2));
  const Edge tie{0, 1};
  field.add(Attachment::of_length(0.5), std::span(&tie, 1), 30);
  Coupling coupling = make_coupling(field, {particle(0, 0), on_rigid(0)});
  const Real omega = std::sqrt(30 / 0.25 * (1 / 2.0 + 1 / 5.0));
  Real worst = 0;
  for (int step = 1; step <= 100; ++step) {
    advance({&body}, 0.02, bodies, {&coupling});
    worst =
        std::max(worst, std::abs((body.position(0) - bodies[0].position).x() - 0.1 * std::cos(omega * 0.02 * step)));
  }
  EXPECT_LT(worst, 1e-4 * 0.1 * 10);
  EXPECT_LT((body.position(0) * 2 + bodies[0].position * 5 - Vector3(0.2, 0, 0)).norm(), 1e-13);
}

TEST(Coupling, StaysStableHoweverLightTheRigidBodyAndFarTheAnchor) {
  for (const Real mass : {1e-3, 1.0, 1e3}) {
    Train train;
    train.sphere = make_sphere(mass, 0.05, {9, 0.5, 0.5});
    RigidBody bodies[] = {train.sphere};
    bodies[0].velocity = {0, 1, 0};
    for (int step = 0; step < 20; ++step) advance({&train.first, &train.second}, 1.0 / 60, bodies, {&train.coupling});
    EXPECT_TRUE(train.first.body.report.finite);
    EXPECT_EQ(train.first.body.report.retries, 0) << "mass " << mass;
    EXPECT_LT(bodies[0].velocity.norm(), 100);
  }
}

TEST(Coupling, WorkIsInTheFlowsOfTheBody) {
  Train train;
  train.first.body.options.safety = train.second.body.options.safety = 0.05;
  RigidBody bodies[] = {train.sphere};
  bodies[0].velocity = {3, 1, 0};
  for (int step = 0; step < 60; ++step) advance({&train.first, &train.second}, 1.0 / 60, bodies, {&train.coupling});
  for (const Body* body : {&train.first, &train.second}) {
    EXPECT_GT(body->body.flows.couplings, 1);
    EXPECT_NEAR(body->energy(), body->body.flows.couplings, 0.01 * body->body.flows.couplings);
  }
}

TEST(Coupling, AWeightThatHangsOnANodeAtRestDoesNoWork) {
  Eigen::Matrix3Xd rest(3, 1);
  rest << Vector3(0, 0, 0);
  Body body = make_free_particles(rest, {0.02});
  body.body.gravity = {0, -9.81, 0};
  RigidBody hook;
  hook.position = {0, 1, 0};
  RigidBody bodies[] = {hook, make_sphere(1, 0.1, {0, -1, 0})};
  bodies[1].acceleration = {0, -9.81, 0};
  Eigen::Matrix3Xd points(3, 3);
  points << Vector3(0, 0, 0), Vector3(0, 1, 0), Vector3(0, -1, 0);
  PotentialField field(points);
  field.add<Length>(std::vector<Edge>{{0, 1}, {0, 2}}, 1000);
  Coupling coupling = make_coupling(field, {particle(0, 0), on_rigid(0), on_rigid(1)});
  coupling.damping_time = 0.02;
  for (int step = 0; step < 6000; ++step) advance({&body}, 1.0 / 60, bodies, {&coupling});
  const Real before = body.body.flows.couplings;
  for (int step = 0; step < 60; ++step) advance({&body}, 1.0 / 60, bodies, {&coupling});
  EXPECT_LT(bodies[1].velocity.norm(), 1e-6);
  EXPECT_NEAR(body.body.flows.couplings, before, 1e-6);
}

TEST(Coupling, BoundOfTheEigenvalueHoldsHoweverTheBodiesTurn) {
  // Three ropes at right angles when at rest; later they may pull together.
  Body body = make_free_particles(Eigen::Matrix3Xd::Zero(3, 1), {1});
  RigidBody hooks[3];
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 4);
  std::vector<Side> coupled{particle(0, 0)};
  std::vector<Edge> ropes;
  for (int k = 0; k < 3; ++k) {
    points.col(k + 1) = Vector3::Unit(k);
    coupled.push_back(on_rigid(k));
    ropes.push_back({0, k + 1});
  }
  PotentialField field(points);
  field.add<Length>(ropes, 1e4);
  Coupling coupling = make_coupling(field, std::move(coupled));
  const Island island{.bodies = {&body.body}, .rigid_bodies = {hooks, hooks + 3}};
  estimate_stability(coupling, island, false);
  PackedVectors parallel = field.rest_positions();
  for (int k = 1; k < 4; ++k) parallel.col(k).head<3>() = Vector3::UnitX();
  const Real largest = true_largest_eigenvalue(field, parallel, {1, 0, 0, 0});
  EXPECT_NEAR(largest, 3e4, 1e-6);
  EXPECT_GE(coupling.largest_eigenvalue, largest);
}

TEST(Coupling, ObstaclesThatMoveDoWork) {
  // A kinematic body drags a particle by a rope: nothing grows without a source.
  Eigen::Matrix3Xd rest(3, 1);
  rest << Vector3(0, 0, 0);
  Body body = make_free_particles(rest, {1});
  RigidBody bodies[1];
  bodies[0].position = {1, 0, 0};
  bodies[0].velocity = {2, 0, 0};
  Eigen::Matrix3Xd points(3, 2);
  points << Vector3(0, 0, 0), Vector3(1, 0, 0);
  PotentialField field(points);
  const Edge rope{0, 1};
  field.add<Length>(std::span(&rope, 1), 100).set_free_play(0, -infinite, 0);
  Coupling coupling = make_coupling(field, {particle(0, 0), on_rigid(0)});
  coupling.damping_time = 0.05;
  for (int step = 0; step < 300; ++step) {
    advance({&body}, 1.0 / 60, bodies, {&coupling});
    EXPECT_LE(body.body.report.retries, 1) << "the work of the obstacle was taken for growth";
  }
  EXPECT_EQ(bodies[0].velocity, Vector3(2, 0, 0));
  EXPECT_NEAR(bodies[0].position.x(), 11, 1e-9);
  // The rope of 1 m is elastic and damps only while it is taut: the particle swings about the hand.
  EXPECT_NEAR(body.position(0).x(), 11, 1.3);
  EXPECT_LT(std::abs(body.velocity(0).x()), 4.1);
}

// Points of faces, some of which share particles, tied to a rigid body: what an embedded surface is held by.
struct HeldSkin {
  Body beam = make_beam_body(2);
  RigidBody sphere = make_sphere(2000, 0.5, {5, 0.5, 0.5});
  std::unique_ptr<PotentialField> field;
  Coupling coupling;

  HeldSkin() {
    const std::vector<Triangle> faces = boundary_faces(make_beam(2).tetrahedra);
    std::vector<Side> points;
    std::vector<Edge> ties;
    Eigen::Matrix3Xd rest(3, 0);
    for (const Triangle& face : faces) {
      const WeightedPoint point{{face[0], face[1], face[2]}, {0.2, 0.3, 0.5}, 3};
      const Vector3 x = point.of(beam.particles().positions);
      if (!(x.x() > 3.5)) continue;
      rest.conservativeResize(3, rest.cols() + 2);
      rest.rightCols<2>() << x, x;
      ties.push_back({static_cast<int>(points.size()), static_cast<int>(points.size()) + 1});
      points.push_back(Side::of_particles(0, point));
      points.push_back(on_rigid(0, x - sphere.position));
    }
    field = std::make_unique<PotentialField>(rest);
    field->add(Attachment::of_length(1), ties, 1e6);
    coupling = make_coupling(*field, std::move(points));
  }
};

TEST(Coupling, OfPointsOfFacesKeepsMomentaAndStaysStable) {
  HeldSkin skin;
  skin.beam.body.options.safety = 0.5;  // at 0.99 Verlet's energy swings by more than the guard lets pass
  ASSERT_GE(skin.coupling.points.size(), 24u);
  RigidBody bodies[] = {skin.sphere};
  bodies[0].velocity = {0.1, 0.05, 0};  // small strains: the estimate is of the rest shape
  bodies[0].angular_velocity = {0.05, 0, 0.1};
  const Momentum before = momentum({&skin.beam}, bodies);
  int retries = 0;
  for (int step = 0; step < 60; ++step) {
    advance({&skin.beam}, 1.0 / 60, bodies, {&skin.coupling});
    ASSERT_TRUE(skin.beam.body.report.finite);
    retries += skin.beam.body.report.retries;
  }
  EXPECT_EQ(retries, 0) << "the bound knows that points share particles";
  const Momentum after = momentum({&skin.beam}, bodies);
  EXPECT_GT(linear_momentum(skin.beam.particles()).norm(), 10);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angular.norm());
}

TEST(Coupling, DampingOfPointsThatShareParticlesOnlyTakesEnergy) {
  HeldSkin skin;
  skin.coupling.damping_time = 10;  // far more than the sub-cycle could take explicitly
  RigidBody bodies[] = {skin.sphere};
  bodies[0].velocity = {1, 0.5, 0};
  const auto energy = [&] { return skin.beam.energy() + skin.coupling.elastic_energy + kinetic_energy(bodies[0]); };
  Real last = energy();
  const Real start = last;
  for (int step = 0; step < 60; ++step) {
    advance({&skin.beam}, 1.0 / 60, bodies, {&skin.coupling});
    EXPECT_LT(energy(), last * 1.005);
    last = energy();
  }
  EXPECT_LT(last, 0.9 * start);
}

}  // namespace
}  // namespace penalty::testing
