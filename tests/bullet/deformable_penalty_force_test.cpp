// The force for applications that keep Bullet's own deformable solver.
#include "bullet/simulation.h"

#include <BulletSoftBody/btDeformableGravityForce.h>

#include "penalty/bullet/deformable_penalty_force.h"

namespace penalty::testing {
namespace {

using Vectors3 = btAlignedObjectArray<btVector3>;

class StockDeformable : public ::testing::TestWithParam<WorldKind> {
 protected:
  btSoftBody& add(const TetMesh& mesh, const std::vector<int>& pinned = {}) {
    SoftBodyOptions options;
    options.pinned = pinned;
    options.stock_deformable = true;
    return sim.add(make_soft_body(sim.info(), mesh, options));
  }

  // A ball that belongs to `force`, its nodes numbered from `first`, as the solver would do it.
  btSoftBody& add_evaluated(DeformablePenaltyForce& force, const TetMesh& mesh, Real stiffness, int first = 0) {
    btSoftBody& body = add(mesh);
    for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].index = first + i;
    force.attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, stiffness));
    force.addSoftBody(&body);
    return body;
  }

  static Vectors3 zeros(int size) {
    Vectors3 vectors;
    vectors.resize(size, btVector3(0, 0, 0));
    return vectors;
  }

  static Vectors3 noise(int size, Real amount) {
    Random random(9);
    Vectors3 vectors;
    for (int i = 0; i < size; ++i) vectors.push_back(to_bullet(random.vector(amount)));
    return vectors;
  }

  static Real norm(const Vectors3& v) {
    Real sum = 0;
    for (int i = 0; i < v.size(); ++i) sum += Real(v[i].length2());
    return std::sqrt(sum);
  }

  static Real difference(const Vectors3& a, const Vectors3& b) {
    EXPECT_EQ(a.size(), b.size());
    Real sum = 0;
    for (int i = 0; i < a.size(); ++i) sum += Real((a[i] - b[i]).length2());
    return std::sqrt(sum);
  }

  void move_trial_positions(btSoftBody& body, const Vectors3& dx, Real scale) {
    for (int i = 0; i < body.m_nodes.size(); ++i)
      body.m_nodes[i].m_q = body.m_nodes[i].m_x + btScalar(scale) * dx[body.m_nodes[i].index];
  }

  Simulation sim{WorldKind::deformable, Solver::bullet};
  const TetMesh ball = make_ball(0.5, 2);
};

// Bullet's explicit mode is v += dt f(x) / m, x += dt v.
TEST_P(StockDeformable, ExplicitModeIsSymplecticEuler) {
  DeformablePenaltyForce force;
  btSoftBody& body = add(ball, {0});
  const PotentialField field = make_elastic_field(ball.vertices, ball.tetrahedra, 10.0);
  force.attach(body, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  sim.deformable_world().addForce(&body, &force);
  PackedVectors x(4, body.m_nodes.size()), v = PackedVectors::Zero(4, x.cols()), f(4, x.cols());
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& node = body.m_nodes[i];
    node.m_x *= btScalar(1.0625);
    node.m_q = node.m_x;
    x.col(i) << to_vector(node.m_x), 0;
  }
  const PackedVectors start = x;
  const Real dt = 1.0 / 4096;
  for (int step = 0; step < 200; ++step) {
    f.setZero();
    field.add_forces(x, f);
    for (int i = 0; i < x.cols(); ++i) v.col(i) += dt * Real(body.m_nodes[i].m_im) * f.col(i);
    x += dt * v;
    sim.step(dt);
  }
  EXPECT_GT((x - start).norm(), 0.1);
  Real error = 0;
  for (int i = 0; i < x.cols(); ++i)
    error = std::max(error, (to_vector(body.m_nodes[i].m_x) - x.col(i).head<3>()).norm());
  EXPECT_LT(error, limit(1e-11, 1e-4));
  sim.remove(body);
}

TEST_P(StockDeformable, ImplicitModeLetsABeamSagAndComeToRest) {
  const TetMesh beam = make_box({2, 0.5, 0.5}, {8, 2, 2});
  std::vector<int> pinned;
  for (int i = 0; i < beam.vertices.cols(); ++i)
    if (beam.vertices(0, i) < 1e-9) pinned.push_back(i);
  btSoftBody& body = add(beam, pinned);
  DeformablePenaltyForce force(0.01);
  force.attach(body, make_elastic_field(beam.vertices, beam.tetrahedra, 100.0));
  btDeformableGravityForce gravity(btVector3(0, btScalar(-9.81), 0));
  sim.deformable_world().setImplicit(true);
  sim.deformable_world().setUseProjection(true);
  sim.deformable_world().addForce(&body, &force);
  sim.deformable_world().addForce(&body, &gravity);
  Real most = 0;
  for (int step = 0; step < 300; ++step) {
    sim.step(1.0 / 60);
    most = std::max(most, Real(force.totalElasticEnergy(0)));
    ASSERT_TRUE(std::isfinite(lowest(body))) << "step " << step;
  }
  Real speed = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) speed = std::max(speed, Real(body.m_nodes[i].m_v.length()));
  RecordProperty("lowest", std::to_string(lowest(body)));
  RecordProperty("largest_elastic_energy", std::to_string(most));
  EXPECT_LT(lowest(body), -0.01) << "sags";
  EXPECT_GT(lowest(body), -1);
  EXPECT_LT(most, 9.81) << "no more than 1 kg that falls a metre";
  EXPECT_LT(speed, 0.1);

  // At rest, against the explicit sub-cycle.
  Simulation ours(WorldKind::deformable);
  ours.set_gravity({0, -9.81, 0});
  SoftBodyOptions options;
  options.pinned = pinned;
  btSoftBody& reference =
      ours.add_jelly(beam, {.stiffness = 100, .body = options, .attach = {.step = {.damping_time = 0.05, .drag = 2}}});
  ours.step(1.0 / 60, 300);
  EXPECT_NEAR(lowest(body), lowest(reference), 0.05 * std::abs(lowest(reference)));
  sim.remove(body);
}

TEST_P(StockDeformable, TheElasticDifferentialIsTheDerivativeOfTheForces) {
  DeformablePenaltyForce force;
  const int first = 3;  // of arrays that are longer than the body
  btSoftBody& body = add_evaluated(force, ball, 10, first);
  const int size = first + body.m_nodes.size() + 5;
  const Vectors3 dx = noise(size, 1);
  const Real step = limit(1e-6, 1e-3);
  Vectors3 ahead = zeros(size), behind = zeros(size), df = zeros(size);
  move_trial_positions(body, dx, step);
  force.addScaledExplicitForce(btScalar(0.5 / step), ahead);
  move_trial_positions(body, dx, -step);
  force.addScaledExplicitForce(btScalar(0.5 / step), behind);
  move_trial_positions(body, dx, 0);
  force.addScaledElasticForceDifferential(1, dx, df);
  for (int i = 0; i < size; ++i) ahead[i] -= behind[i];
  ASSERT_GT(norm(df), 100);
  EXPECT_LT(difference(df, ahead), limit(1e-6, 2e-3) * norm(df));
  for (int i = 0; i < size; ++i)
    if (i < first || i >= size - 5) {
      EXPECT_EQ(df[i].length(), 0) << "outside the body";
    }
  Vectors3 halved = zeros(size);
  force.addScaledElasticForceDifferential(btScalar(-0.5), dx, halved);
  for (int i = 0; i < size; ++i) halved[i] *= -2;
  EXPECT_LT(difference(df, halved), limit(1e-12, 1e-5) * norm(df));
  force.removeSoftBody(&body);
}

TEST_P(StockDeformable, TheDampingDifferentialIsTheDampingForceOfAVelocity) {
  DeformablePenaltyForce force(0.02);
  btSoftBody& body = add_evaluated(force, ball, 10);
  const int size = body.m_nodes.size();
  const Vectors3 dv = noise(size, 1);
  Vectors3 df = zeros(size), damping = zeros(size), elastic = zeros(size);
  force.addScaledDampingForceDifferential(1, dv, df);
  force.addScaledElasticForceDifferential(btScalar(0.02), dv, elastic);
  for (int i = 0; i < size; ++i) body.m_nodes[i].m_v = dv[i];
  force.addScaledDampingForce(1, damping);
  ASSERT_GT(norm(df), 1);
  EXPECT_LT(difference(df, damping), limit(1e-12, 1e-5) * norm(df));
  EXPECT_LT(difference(df, elastic), limit(1e-12, 1e-5) * norm(df)) << "stiffness times damping time";
  Real power = 0;
  for (int i = 0; i < size; ++i) power += Real(dv[i].dot(damping[i]));
  EXPECT_LT(power, 0);
  EXPECT_NEAR(force.totalDampingEnergy(btScalar(0.25)), -power / 4, limit(1e-12, 1e-4) * std::abs(power));
  Vectors3 sum = zeros(size);
  move_trial_positions(body, dv, 0.01);
  force.addScaledForces(1, sum);
  force.addScaledExplicitForce(-1, sum);
  force.addScaledDampingForce(-1, sum);
  EXPECT_LT(norm(sum), limit(1e-10, 1e-3)) << "the forces are the elastic ones and those of damping";
  force.removeSoftBody(&body);
}

TEST_P(StockDeformable, DiagonalsAreThoseOfTheDifferentials) {
  const Real damping_time = 0.02;
  DeformablePenaltyForce force(damping_time);
  btSoftBody& body = add_evaluated(force, ball, 10);
  const int size = body.m_nodes.size();
  Vectors3 diagonal = zeros(size);
  force.buildDampingForceDifferentialDiagonal(2, diagonal);
  for (int i = 0; i < size; ++i) body.m_nodes[i].m_effectiveMass = btMatrix3x3::getIdentity();
  force.addScaledHessian(btScalar(0.5));
  for (const int i : {0, 7, size - 1})
    for (int axis = 0; axis < 3; ++axis) {
      Vectors3 unit = zeros(size), damping = zeros(size), elastic = zeros(size);
      unit[i][axis] = 1;
      force.addScaledDampingForceDifferential(2, unit, damping);
      force.addScaledElasticForceDifferential(1, unit, elastic);
      const Real expected = Real(damping[i][axis]);
      ASSERT_LT(expected, -0.1);
      EXPECT_NEAR(Real(diagonal[i][axis]), expected, limit(1e-10, 1e-4) * std::abs(expected));
      // m + scale² k: the effective mass of an implicit step of `scale` seconds.
      const Real mass = 1 - Real(elastic[i][axis]) / 4;
      EXPECT_NEAR(Real(body.m_nodes[i].m_effectiveMass[axis][axis]), mass, limit(1e-10, 1e-4) * mass);
    }
  force.removeSoftBody(&body);
}

TEST_P(StockDeformable, TheEnergyIsThatOfTheField) {
  DeformablePenaltyForce force;
  btSoftBody& body = add_evaluated(force, ball, 10);
  EXPECT_NEAR(force.totalElasticEnergy(0), 0, limit(1e-20, 1e-9));
  move_trial_positions(body, noise(body.m_nodes.size(), 1), 0.05);
  PackedVectors x = PackedVectors::Zero(4, body.m_nodes.size());
  for (int i = 0; i < body.m_nodes.size(); ++i) x.col(i).head<3>() = to_vector(body.m_nodes[i].m_q);
  const Real energy = make_elastic_field(ball.vertices, ball.tetrahedra, 10.0).energy(x);
  ASSERT_GT(energy, 1);
  EXPECT_NEAR(force.totalElasticEnergy(0), energy, 1e-12 * energy);
  EXPECT_NEAR(force.totalEnergy(btScalar(0.1)), energy, 1e-12 * energy) << "no damping";
  force.removeSoftBody(&body);
}

TEST_P(StockDeformable, TwoForcesAreNotMerged) {
  DeformablePenaltyForce soft, stiff;
  EXPECT_NE(static_cast<int>(soft.getForceType()), static_cast<int>(stiff.getForceType()));
  btSoftBody &first = add(moved(ball, {-2, 0, 0})), &second = add(moved(ball, {2, 0, 0}));
  soft.attach(first, make_elastic_field(ball.vertices, ball.tetrahedra, 1.0));
  stiff.attach(second, make_elastic_field(ball.vertices, ball.tetrahedra, 16.0));
  sim.deformable_world().addForce(&first, &soft);
  sim.deformable_world().addForce(&second, &stiff);
  for (btSoftBody* body : {&first, &second}) {
    body->m_nodes[20].m_x += btVector3(btScalar(0.0625), 0, 0);
    body->m_nodes[20].m_q = body->m_nodes[20].m_x;
  }
  EXPECT_NEAR(stiff.totalElasticEnergy(0), 16 * soft.totalElasticEnergy(0), limit(1e-9, 1e-4));
  sim.step(1.0 / 4096);
  const Real ratio = Real(second.m_nodes[20].m_v.length() / first.m_nodes[20].m_v.length());
  EXPECT_NEAR(ratio, 16, limit(1e-9, 1e-2));
  sim.deformable_world().removeForce(&first, &soft);
  const btVector3 before = first.m_nodes[20].m_v, before_second = second.m_nodes[20].m_v;
  sim.step(1.0 / 4096);
  EXPECT_EQ(first.m_nodes[20].m_v, before) << "no force any more";
  EXPECT_NE(second.m_nodes[20].m_v, before_second);
  sim.remove(first);
  sim.remove(second);
}

TEST_P(StockDeformable, BodiesThatSleepOrWereNotAddedFeelNothing) {
  DeformablePenaltyForce force(0.01);
  btSoftBody& body = add_evaluated(force, ball, 10);
  const int size = body.m_nodes.size();
  move_trial_positions(body, noise(size, 1), 0.05);
  Vectors3 awake = zeros(size), asleep = zeros(size), removed = zeros(size);
  force.addScaledForces(1, awake);
  EXPECT_GT(norm(awake), 1);
  body.forceActivationState(ISLAND_SLEEPING);
  force.addScaledForces(1, asleep);
  force.addScaledElasticForceDifferential(1, awake, asleep);
  force.addScaledDampingForceDifferential(1, awake, asleep);
  EXPECT_EQ(norm(asleep), 0);
  EXPECT_EQ(force.totalElasticEnergy(0), 0);
  body.forceActivationState(DISABLE_DEACTIVATION);
  force.removeSoftBody(&body);
  force.addScaledForces(1, removed);
  EXPECT_EQ(norm(removed), 0);
  force.addSoftBody(&body);
  force.detach(body);
  force.addScaledForces(1, removed);
  EXPECT_EQ(norm(removed), 0);
  force.removeSoftBody(&body);
}

TEST_P(StockDeformable, NodesMayBeNumberedAnew) {
  Simulation alone(WorldKind::deformable, Solver::bullet);
  DeformablePenaltyForce force, force_alone;
  btSoftBody &gone = add(moved(ball, {-3, 0, 0})), &body = add(ball);
  SoftBodyOptions options;
  options.stock_deformable = true;
  btSoftBody& reference = alone.add(make_soft_body(alone.info(), ball, options));
  force.attach(gone, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  force.attach(body, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  force_alone.attach(reference, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  sim.deformable_world().addForce(&gone, &force);
  sim.deformable_world().addForce(&body, &force);
  alone.deformable_world().addForce(&reference, &force_alone);
  for (btSoftBody* b : {&body, &reference}) {
    b->m_nodes[20].m_x += btVector3(btScalar(0.0625), 0, 0);
    b->m_nodes[20].m_q = b->m_nodes[20].m_x;
  }
  for (int step = 0; step < 40; ++step) {
    if (step == 10) {
      force.detach(gone);
      sim.remove(gone);
    }
    sim.step(1.0 / 4096);
    alone.step(1.0 / 4096);
    for (int i = 0; i < body.m_nodes.size(); ++i)
      ASSERT_EQ((body.m_nodes[i].m_x - reference.m_nodes[i].m_x).length(), 0) << "step " << step << ", node " << i;
  }
  sim.remove(body);
  alone.remove(reference);
}

INSTANTIATE_TEST_SUITE_P(World, StockDeformable, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
