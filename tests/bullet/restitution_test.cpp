// Bullet's restitution of both objects, beside what an elastic body gives back by itself.
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <cmath>
#include <limits>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

const Material rubber{.young = 1e7, .poisson = 0.35, .density = 1000, .damping = 0.002};

/// A body made of a material, its lowest point at a height above y = 0.
btSoftBody& add_body(Simulation& sim, TetMesh mesh, const Material& material, Real height, Real speed, Real restitution,
                     const StepOptions& step = {}) {
  const Real size = (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).maxCoeff();
  mesh = moved(mesh, {0, height - mesh.vertices.row(1).minCoeff(), 0});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh, material));
  body.getCollisionShape()->setMargin(static_cast<btScalar>(0.02 * size));
  body.setVelocity(btVector3(0, static_cast<btScalar>(-speed), 0));
  body.setRestitution(static_cast<btScalar>(restitution));
  sim.penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, material, ElasticModel::neo_hookean),
                       {.step = step});
  return body;
}

Vector3 mean_velocity(Simulation& sim, const btSoftBody& body) {
  const Particles& particles = sim.penalty().particles(body);
  Real mass = 0;
  for (const Real inverse_mass : particles.inverse_masses) mass += 1 / inverse_mass;
  return linear_momentum(particles) / mass;
}

struct Rebound {
  Real speed;   // relative to that of arrival
  Real energy;  // relative to that of arrival, what vibrates included
};

/// Of a body that arrives at a ground with restitution 1; no gravity. Substeps are short, so that the energy of the
/// integrator does not waver while the body vibrates.
Rebound rebound_of(WorldKind kind, const TetMesh& mesh, const Material& material, Real restitution, Real speed = 5) {
  Simulation sim(kind);
  const Real size = (mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff()).maxCoeff();
  btRigidBody& ground = sim.add_ground();
  ground.setRestitution(1);
  const btSoftBody& body =
      add_body(sim, mesh, material, 0.05 * size, speed, restitution, {.safety = 0.15, .contact_safety = 0.15});
  const Real before = sim.totals().energy;
  for (int k = 0; k < 120 && lowest(body) < 0.1 * size; ++k) {
    sim.step(frame);
    EXPECT_LE(sim.totals().energy, before * (1 + limit(1e-4, 1e-3))) << "frame " << k;
  }
  EXPECT_GT(lowest(body), 0.1 * size);
  return {mean_velocity(sim, body).y() / speed, sim.totals().energy / before};
}

class RestitutionTest : public WorldTest {};

TEST_P(RestitutionTest, MakesTheReboundOfAStiffBallGrow) {
  const TetMesh ball = make_ball(0.5, 4);
  const Rebound own = rebound_of(GetParam(), ball, rubber, 0);
  EXPECT_GT(own.energy, 0.7);
  EXPECT_LT(own.energy, 0.9);
  Real last = own.speed;
  for (const Real e : {0.25, 0.5, 0.9, 1.0}) {
    const Real speed = rebound_of(GetParam(), ball, rubber, e).speed;
    EXPECT_GT(speed, last);
    last = speed;
    // What was lost comes back to e².
    EXPECT_NEAR(speed * speed, own.speed * own.speed + e * e * (1 - own.energy), 0.02) << e;
    if (e == 0.9) {
      EXPECT_GT(speed, 0.8);
    }
  }
}

// Of a body that gives almost nothing back it is near Newton's: it leaves dented, and that much is not lost.
TEST_P(RestitutionTest, OfADeadBodyIsNearlyThatOfARigidOne) {
  Material dead = rubber;
  dead.young = 1e5;
  dead.damping = 0.5;
  const TetMesh ball = make_ball(0.5, 3);
  const Real own = rebound_of(GetParam(), ball, dead, 1e-3).speed;
  EXPECT_LT(own, 0.4);
  for (const Real e : {0.5, 0.9})
    EXPECT_NEAR(rebound_of(GetParam(), ball, dead, e).speed, std::sqrt(own * own + e * e * (1 - own * own)), 0.1) << e;
}

TEST_P(RestitutionTest, TakesNoEnergyFromNowhere) {
  Material material = rubber;
  for (const Real damping : {0.0, 0.002}) {
    material.damping = damping;
    for (const TetMesh& mesh : {make_ball(0.5, 3), make_box({1, 1, 1}, {3, 3, 3}), make_torus(0.7, 0.3, 2, 14)})
      EXPECT_LE(rebound_of(GetParam(), mesh, material, 1).energy, 1 + limit(1e-4, 1e-3));
  }
}

TEST_P(RestitutionTest, IsTheSameForBodiesOfAMillimetreAndOfTenMetres) {
  Material material = rubber;
  for (const Real radius : {0.0005, 5.0}) {
    SCOPED_TRACE(radius);
    material.young = 1e7;
    // The same numbers without dimension: speeds as they are, times with the size.
    material.damping = 0.002 * radius / 0.5;
    const Rebound own = rebound_of(GetParam(), make_ball(radius, 2), material, 0, 2);
    const Rebound with = rebound_of(GetParam(), make_ball(radius, 2), material, 0.9, 2);
    EXPECT_GT(with.speed, own.speed);
    EXPECT_GT(with.speed, 0.8);
    EXPECT_LE(with.energy, 1);
  }
}

TEST_P(RestitutionTest, OfOneAloneIsNone) {
  const auto run = [&](Real of_ground, Real of_body) {
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    own.add_ground().setRestitution(static_cast<btScalar>(of_ground));
    const btSoftBody& body = add_body(own, make_ball(0.5, 2), rubber, 0.5, 0, of_body);
    own.step(frame, 60);
    return mean_velocity(own, body);
  };
  const Vector3 none = run(0, 0);
  EXPECT_EQ(run(1, 0), none);
  EXPECT_EQ(run(0, 1), none);
  EXPECT_NE(run(1, 1), none);
  EXPECT_EQ(run(3, 2), run(1, 1)) << "at most 1";
  EXPECT_EQ(run(-1, 1), none);
}

TEST_P(RestitutionTest, LetsABodyComeToRest) {
  sim.set_gravity({0, -g, 0});
  sim.add_ground().setRestitution(1);
  Material jelly = rubber;
  jelly.young = 1e5;
  jelly.damping = 0.02;
  const btSoftBody& box = add_body(sim, make_box({1, 1, 1}, {3, 3, 3}), jelly, 0.52, 0, 0.9);
  Real highest = sim.totals().energy, before = highest;
  const Real scale = 1000 * g * 0.5;
  for (int k = 0; k < 360; ++k) {
    sim.step(frame);
    const Real energy = sim.totals().energy;
    EXPECT_LE(energy, highest + 1e-4 * scale);
    if (k > 300) {
      EXPECT_NEAR(energy, before, 1e-6 * scale) << "rest, frame " << k;
    }
    before = energy;
  }
  EXPECT_LT(sim.penalty().particles(box).velocities.colwise().norm().maxCoeff(), 1e-3);
  EXPECT_LT(lowest(box), 0.021);
}

// Set down it lies, whatever its restitution is.
TEST_P(RestitutionTest, DoesNothingToABodyThatLies) {
  const auto run = [&](Real restitution) {
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    own.add_ground().setRestitution(1);
    Material jelly = rubber;
    jelly.young = 2e4;
    const btSoftBody& box = add_body(own, make_box({1, 1, 1}, {3, 3, 3}), jelly, 0.02, 0, restitution);
    own.step(frame, 60);
    return Vector3(mean_velocity(own, box));
  };
  EXPECT_EQ(run(0.9), run(0));
}

TEST_P(RestitutionTest, OfSoftBodiesThatHitEachOtherKeepsBothMomenta) {
  Real last = 0;
  for (const Real e : {0.0, 0.5, 1.0}) {
    SCOPED_TRACE(e);
    Simulation own(GetParam());
    btSoftBody& left = add_body(own, make_ball(0.5, 3), rubber, 0, 0, e);
    btSoftBody& right = add_body(own, make_ball(0.4, 3), rubber, 0, 0, 1);
    left.translate(btVector3(-1, btScalar(0.2), 0));
    left.setVelocity(btVector3(4, 0, 0));
    own.step(frame / 10);
    const Totals before = own.totals();
    for (int k = 0; k < 40; ++k) {
      own.step(frame);
      EXPECT_LE(own.totals().energy, before.energy * (1 + limit(1e-4, 1e-3)));
    }
    const Totals after = own.totals();
    EXPECT_LT((after.momentum - before.momentum).norm(), limit(1e-10, 1e-3) * before.momentum.norm());
    EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(),
              limit(1e-10, 1e-3) * before.angular_momentum.norm());
    const Real leaving = (mean_velocity(own, right) - mean_velocity(own, left)).norm();
    EXPECT_GT(leaving, last + 0.01);
    last = leaving;
  }
}

TEST_P(RestitutionTest, OfABodyThatHitsARigidOneKeepsBothMomentaAndIsReported) {
  for (const Real e : {0.0, 0.8}) {
    SCOPED_TRACE(e);
    Simulation own(GetParam());
    add_body(own, make_ball(0.5, 3), rubber, 0.2, 3, e);
    btRigidBody& box = own.add_box({0.5, 0.2, 0.5}, 300, {0.2, -0.1, 0});
    box.setRestitution(1);
    const Totals before = own.totals();
    Vector3 given = Vector3::Zero();
    for (int k = 0; k < 40; ++k) {
      own.step(frame);
      given += frame * own.penalty().contact_force(box).force;
    }
    const Totals after = own.totals();
    EXPECT_LT((after.momentum - before.momentum).norm(), limit(1e-10, 1e-4) * before.momentum.norm());
    EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), limit(0.02, 0.02) * before.momentum.norm())
        << "but for the gyroscopic term of the box";
    EXPECT_LE(after.energy, before.energy * (1 + limit(1e-4, 1e-3)));
    const Vector3 taken = 300 * to_vector(box.getLinearVelocity());
    EXPECT_LT((given - taken).norm(), 1e-3 * taken.norm());
  }
}

// A heavy ball on a body that lies on the ground, and on a cloth that is pinned: held, they do not fly off.
TEST_P(RestitutionTest, ThrowsARigidBallBackFromWhatIsHeld) {
  const auto rebound = [&](Real e) {
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    own.add_ground();
    Material jelly = rubber;
    jelly.young = 1e5;
    jelly.damping = 0.05;
    btSoftBody& slab = add_body(own, make_box({1, 0.5, 1}, {4, 2, 4}), jelly, 0.02, 0, 1);
    for (int i = 0; i < slab.m_nodes.size(); ++i)
      if (slab.m_nodes[i].m_x.y() < btScalar(0.03)) slab.setMass(i, 0);
    btRigidBody& ball = own.add_rigid(std::make_unique<btSphereShape>(btScalar(0.25)), 20, {0.5, 1.3, 0.5});
    ball.setRestitution(static_cast<btScalar>(e));
    Real down = 0, up = 0;
    for (int k = 0; k < 90; ++k) {
      own.step(frame);
      const Real v = Real(ball.getLinearVelocity().y());
      down = std::min(down, v);
      up = std::max(up, v);
    }
    return -up / down;
  };
  const Real own = rebound(0), with = rebound(0.9);
  EXPECT_GT(with, own + 0.1);
  EXPECT_LT(with, 1);
}

TEST_P(RestitutionTest, IsTheSameOnEveryShape) {
  const auto rebound = [&](std::unique_ptr<btCollisionShape> shape, const Vector3& at) {
    Simulation own(GetParam());
    own.add_rigid(std::move(shape), 0, at).setRestitution(1);
    const btSoftBody& ball = add_body(own, make_ball(0.5, 3), rubber, 0.1, 4, 0.9);
    own.step(frame, 20);
    return mean_velocity(own, ball).y() / 4;
  };
  const Real on_box = rebound(std::make_unique<btBoxShape>(btVector3(5, 1, 5)), {0, -1, 0});
  EXPECT_GT(on_box, 0.9);
  EXPECT_NEAR(rebound(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), {0, 0, 0}), on_box, 0.01);
  EXPECT_NEAR(rebound(std::make_unique<btSphereShape>(btScalar(20)), {0, -20, 0}), on_box, 0.05);
}

TEST_P(RestitutionTest, ThatIsNoNumberIsSaidAndLeftOut) {
  btRigidBody& ground = sim.add_ground();
  ground.setRestitution(std::numeric_limits<btScalar>::quiet_NaN());
  btSoftBody& ball = add_body(sim, make_ball(0.5, 2), rubber, 0.02, 2, 1);
  sim.step(frame);
  EXPECT_EQ(sim.penalty().report(ball).problem,
            "the restitution of an object that it touches is not finite, and was left out");
  EXPECT_TRUE(mean_velocity(sim, ball).allFinite());
  ground.setRestitution(1);
  ball.setRestitution(std::numeric_limits<btScalar>::infinity());
  sim.step(frame);
  EXPECT_EQ(sim.penalty().report(ball).problem, "its restitution is not finite");
}

INSTANTIATE_TEST_SUITE_P(World, RestitutionTest, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
