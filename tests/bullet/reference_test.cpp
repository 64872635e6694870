// A free body in a world moves as without Bullet: against the integrator alone and against closed forms.
#include <cmath>

#include "bullet/simulation.h"
#include "penalty/stepping/island.h"

namespace penalty::testing {
namespace {

class Reference : public WorldTest {
 protected:
  // A ball that moves, spins, is stretched and shaken.
  btSoftBody& add_noisy_ball(const AttachOptions& attach = {}) {
    const TetMesh ball = make_ball(0.5, 2);
    btSoftBody& body = sim.add(make_soft_body(sim.info(), ball, {.mass = 2}));
    Random random(7);
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const Vector3 x = ball.vertices.col(i);
      body.m_nodes[i].m_v =
          to_bullet(Vector3(Vector3(1, -0.5, 0.25) + Vector3(0.5, 1, 2).cross(x) + random.vector(0.5)));
      body.m_nodes[i].m_x *= static_cast<btScalar>(1.125);
    }
    rest_ = ball;
    sim.penalty().attach(body, make_elastic_field(ball.vertices, ball.tetrahedra, 5.0), attach);
    return body;
  }

  // The same state for the integrator alone.
  SteppedBody copy_of(const btSoftBody& body, PotentialField& field, const StepOptions& options) {
    SteppedBody copy;
    copy.particles = sim.penalty().particles(body);
    copy.field = &field;
    copy.options = options;
    copy.gravity = to_vector(sim.info().m_gravity);
    estimate_stability(copy);
    return copy;
  }

  // What the world hands on as time step: the classic one rounds it to single precision.
  Real handed_on(Real duration) const {
    return GetParam() == WorldKind::classic ? Real(static_cast<float>(duration))
                                            : Real(static_cast<btScalar>(duration));
  }

  TetMesh rest_;
};

Real largest_difference(const PackedVectors& a, const PackedVectors& b) { return (a - b).cwiseAbs().maxCoeff(); }

TEST_P(Reference, FreeFlightIsThatOfTheIntegratorAloneToTheLastBit) {
  btSoftBody& body = add_noisy_ball();
  PotentialField field = make_elastic_field(rest_.vertices, rest_.tetrahedra, 5.0);
  SteppedBody copy = copy_of(body, field, {});
  Island island{.bodies = {&copy}};
  const PackedVectors start = copy.particles.positions;
  for (int step = 0; step < 20; ++step) {
    advance(island, 1.0 / 64);
    sim.step(1.0 / 64);
    ASSERT_EQ(sim.penalty().particles(body).positions, copy.particles.positions) << "step " << step;
    ASSERT_EQ(sim.penalty().particles(body).velocities, copy.particles.velocities) << "step " << step;
    ASSERT_EQ(sim.penalty().report(body).substeps, copy.report.substeps) << "step " << step;
  }
  EXPECT_GT(largest_difference(copy.particles.positions, start), 0.2);
  for (int i = 0; i < copy.particles.size(); ++i) {
    const Vector3 difference = to_vector(body.m_nodes[i].m_x) - copy.particles.positions.col(i).head<3>();
    ASSERT_LE(difference.norm(), limit(0, 1e-7)) << "node " << i;  // rounded to the nodes' precision
  }
}

TEST_P(Reference, WithGravityDampingAndDragItIsTheSame) {
  sim.set_gravity({0.5, -9.75, 0.25});
  const StepOptions options{.damping_time = 0.001, .drag = 0.5};
  btSoftBody& body = add_noisy_ball({.step = options});
  PotentialField field = make_elastic_field(rest_.vertices, rest_.tetrahedra, 5.0);
  SteppedBody copy = copy_of(body, field, options);
  Island island{.bodies = {&copy}};
  for (int step = 0; step < 20; ++step) {
    advance(island, 1.0 / 64);
    sim.step(1.0 / 64);
    ASSERT_EQ(sim.penalty().particles(body).positions, copy.particles.positions) << "step " << step;
    ASSERT_EQ(sim.penalty().particles(body).velocities, copy.particles.velocities) << "step " << step;
  }
}

TEST_P(Reference, AStepThatIsNotDyadicIsOnlyRounded) {
  btSoftBody& body = add_noisy_ball();
  PotentialField field = make_elastic_field(rest_.vertices, rest_.tetrahedra, 5.0);
  SteppedBody rounded = copy_of(body, field, {}), exact = copy_of(body, field, {});
  Island rounded_island{.bodies = {&rounded}}, exact_island{.bodies = {&exact}};
  for (int step = 0; step < 20; ++step) {
    advance(rounded_island, handed_on(1.0 / 60));
    advance(exact_island, 1.0 / 60);
    sim.step(1.0 / 60);
  }
  EXPECT_EQ(sim.penalty().particles(body).positions, rounded.particles.positions);
  // A step longer by the rounding 2^-25 leads ahead by that share of the path travelled; factor 10 for the frequency of
  // the discrete motion, which depends on the substep too.
  const Real path = exact.particles.velocities.colwise().norm().maxCoeff() * 20 / 60;
  const Real difference = largest_difference(rounded.particles.positions, exact.particles.positions);
  RecordProperty("difference", std::to_string(difference * 1e9) + " nm");
  EXPECT_LE(difference, 10 * path * 0x1p-25);
}

// Two particles, stretched from 1 m to 1.25 m at rest. Velocity Verlet of r'' = -w² r has r_k = r_0 cos(k a) and
// v_k = -r_0 sin(k a) sin(a) / h with cos(a) = 1 - w² h² / 2: that is exact, not an approximation of small h.
TEST_P(Reference, SpringMatchesClosedFormVelocityVerlet) {
  const btVector3 positions[] = {{0, 0, 0}, {static_cast<btScalar>(1.25), 0, 0}};
  const btScalar masses[] = {static_cast<btScalar>(0.5), 2};
  btSoftBody& body = sim.add(std::make_unique<btSoftBody>(&sim.info(), 2, positions, masses));
  Eigen::Matrix3Xd rest(3, 2);
  rest << 0, 1, 0, 0, 0, 0;
  PotentialField field(rest);
  const Real stiffness = 40;  // J, with a rest length of 1 m also N/m
  field.add<Length>(std::vector<std::array<int, 2>>{{0, 1}}, stiffness);
  const int substeps = 4;
  sim.penalty().attach(body, std::move(field), {.step = {.substeps = substeps}});

  const Real h = 1.0 / 64 / substeps, w2 = stiffness * (1 / 0.5 + 1 / 2.0), r0 = 0.25;
  const Real angle = std::acos(1 - w2 * h * h / 2);
  for (int step = 1; step <= 300; ++step) {
    sim.step(1.0 / 64);
    const Particles& p = sim.penalty().particles(body);
    const Real phase = step * substeps * angle;
    ASSERT_NEAR(p.positions(0, 1) - p.positions(0, 0) - 1, r0 * std::cos(phase), 1e-11) << "step " << step;
    ASSERT_NEAR(p.velocities(0, 1) - p.velocities(0, 0), -r0 * std::sin(phase) * std::sin(angle) / h, 1e-10);
    ASSERT_NEAR(0.5 * p.positions(0, 0) + 2 * p.positions(0, 1), 2.5, 1e-12) << "centre of mass";
    ASSERT_EQ(p.positions.bottomRows<3>().norm(), 0);
  }
}

TEST_P(Reference, FallsAlongTheParabola) {
  sim.set_gravity({0, -9.75, 1.5});
  btSoftBody& body = sim.add_jelly(make_ball(0.5, 2));
  const Vector3 v0(1, 4, -0.5), g(0, -9.75, 1.5);
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = to_bullet(v0);
  const PackedVectors start = sim.penalty().particles(body).positions;
  for (int step = 1; step <= 128; ++step) sim.step(1.0 / 64);
  const Vector3 path = 2 * v0 + g * 2 * 2 / 2;  // Verlet is exact for constant forces
  const Particles& p = sim.penalty().particles(body);
  // Inside the body is at rest up to rounding, of its start positions too: a part in 2^24 in single precision.
  EXPECT_LT(largest_difference(p.positions - start, pack(path.replicate(1, p.size()))), limit(1e-12, 1e-6));
  EXPECT_LT(largest_difference(p.velocities, pack((v0 + 2 * g).replicate(1, p.size()))), limit(1e-11, 1e-4));
  EXPECT_LT((center_of_mass(p) - center_of_mass({start, {}, p.inverse_masses}) - path).norm(), 1e-12);
}

TEST_P(Reference, BulletsOwnSubstepsLoseNothing) {
  Simulation other(GetParam());
  sim.set_gravity({0, -9.75, 0});
  other.set_gravity({0, -9.75, 0});
  const TetMesh ball = make_ball(0.5, 2);
  btSoftBody &in_one = sim.add_jelly(ball), &in_four = other.add_jelly(ball);
  for (int step = 0; step < 20; ++step) {
    for (btSoftBody* body : {&in_one, &in_four}) {
      body->m_nodes[3].m_v += btVector3(1, 0, 0);  // counts once, not once a substep
      body->m_nodes[5].m_x += btVector3(0, static_cast<btScalar>(0.03125), 0);
    }
    sim.step(1.0 / 64, 4);
    other.world().stepSimulation(static_cast<btScalar>(1.0 / 16), 4, static_cast<btScalar>(1.0 / 64));
    ASSERT_EQ(sim.penalty().particles(in_one).positions, other.penalty().particles(in_four).positions) << step;
    ASSERT_EQ(sim.penalty().particles(in_one).velocities, other.penalty().particles(in_four).velocities) << step;
  }
  const Real impulse = 20 / Real(in_one.m_nodes[3].m_im);
  EXPECT_NEAR(linear_momentum(sim.penalty().particles(in_one)).x(), impulse, 1e-9 * impulse + limit(0, 1e-6));
}

TEST_P(Reference, SameStartSameEndToTheLastBit) {
  const auto run = [&] {
    Simulation again(GetParam());
    again.set_gravity({0, -9.81, 0});
    again.add_ground();
    btSoftBody& upper = again.add_jelly(make_ball(0.3, 2), {.shift = {0.1, 0.95, 0}});
    btSoftBody& lower = again.add_jelly(make_ball(0.3, 2), {.shift = {1, 0.35, 0}});
    btRigidBody& box = again.add_box({0.2, 0.2, 0.2}, 1, {0.5, 0.9, 0.05});
    box.setLinearVelocity(btVector3(1, 0, 0));
    again.step(1.0 / 60, 60);
    std::vector<Real> state;
    for (const btSoftBody* body : {&upper, &lower})
      for (const PackedVectors* v :
           {&again.penalty().particles(*body).positions, &again.penalty().particles(*body).velocities})
        state.insert(state.end(), v->data(), v->data() + v->size());
    for (int axis = 0; axis < 3; ++axis) state.push_back(Real(box.getWorldTransform().getOrigin()[axis]));
    return state;
  };
  const std::vector<Real> first = run();
  const auto heap_moved = std::make_unique<char[]>(12345);  // addresses must not matter
  EXPECT_EQ(first, run());
}

INSTANTIATE_TEST_SUITE_P(World, Reference, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
