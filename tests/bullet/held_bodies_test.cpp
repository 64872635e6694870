// A step never throws: a body that cannot be stepped stays where it is, says why, and goes on when that is mended. All
// else goes on as if it were not there.
#include <stdexcept>

#include "bullet/simulation.h"
#include "penalty/bullet/deformable_penalty_force.h"

namespace penalty::testing {
namespace {

Real fastest(const btSoftBody& body) {
  Real speed = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) speed = std::max(speed, Real(body.m_nodes[i].m_v.length()));
  return speed;
}

enum class Mood { good, bad, no_memory, number };

// A length that throws when it is told to.
struct Moody {
  static constexpr std::string_view name = "moody";
  static constexpr int num_points = 2;
  static Moody at_rest(const Points<2>& p) { return {(p.col(1) - p.col(0)).norm()}; }
  Real value(const Points<2>& p) const {
    vent();
    return (p.col(1) - p.col(0)).norm() / length - 1;
  }
  Gradient<2> gradient(const Points<2>& p) const {
    vent();
    Gradient<2> g;
    g.col(1) = (p.col(1) - p.col(0)).normalized() / length;
    g.col(0) = -g.col(1);
    return g;
  }
  static void vent() {
    if (mood == Mood::bad) throw std::runtime_error("not today");
    if (mood == Mood::no_memory) throw std::bad_alloc();
    if (mood == Mood::number) throw 5;
  }
  Real length = 1;
  static inline Mood mood = Mood::good;
};

// A ball that has fallen for a while, with a second one and a rigid box beside it, and the same world without the
// first.
class Held : public WorldTest {
 protected:
  void SetUp() override {
    for (Simulation* s : {&sim, &without}) {
      s->set_gravity({0, -9.81, 0});
      s->add_ground();
      others.push_back(&s->add_jelly(make_ball(0.25, 2), {.shift = {3, 1, 0}}));
      boxes.push_back(&s->add_box({0.1, 0.1, 0.1}, 1, {-3, 5, 0}));
    }
    body = &sim.add_jelly(ball, {.shift = {0, 0.8, 0}});
    step(5);
  }

  void TearDown() override {
    Moody::mood = Mood::good;
    expect_others_undisturbed();
  }

  void step(int count = 1, Real duration = frame) {
    for (int k = 0; k < count; ++k) {
      ASSERT_NO_THROW(sim.step(duration));
      without.step(duration);
    }
  }

  void expect_others_undisturbed() {
    EXPECT_EQ(sim.penalty().particles(*others[0]).positions, without.penalty().particles(*others[1]).positions);
    EXPECT_EQ(sim.penalty().report(*others[0]).problem, "");
    EXPECT_EQ(boxes[0]->getLinearVelocity(), boxes[1]->getLinearVelocity());
    EXPECT_EQ(boxes[0]->getWorldTransform().getOrigin(), boxes[1]->getWorldTransform().getOrigin());
  }

  void expect_at_rest(int steps = 5) {
    const std::vector<Vector3> before = places_of(*body);
    step(steps);
    EXPECT_EQ(places_of(*body), before);
    EXPECT_EQ(fastest(*body), 0);
  }

  // As after a fall on the ground: whole, above it and moving no more than that.
  void expect_recovered() {
    const Real before = lowest(*body);
    step(3);
    EXPECT_LT(lowest(*body), before) << "falls on";
    EXPECT_EQ(sim.penalty().report(*body).problem, "");
    EXPECT_TRUE(sim.penalty().report(*body).finite);
    step(60);
    EXPECT_GT(lowest(*body), 0);
    EXPECT_LT(mean_volume_error(sim.penalty(), *body), 0.1);
  }

  std::string problem() { return sim.penalty().report(*body).problem; }

  const TetMesh ball = make_ball(0.25, 2);
  Simulation without{GetParam()};
  std::vector<btSoftBody*> others;  // in the one world and in the other
  std::vector<btRigidBody*> boxes;
  btSoftBody* body = nullptr;
};

TEST_P(Held, ABodyWithANodeTooMany) {
  const int size = body->m_nodes.size();
  body->appendNode(body->m_nodes[0].m_x + btVector3(0, 1, 0), 1);
  expect_at_rest();
  EXPECT_EQ(problem(), "the soft body has " + std::to_string(size + 1) + " nodes, had " + std::to_string(size) +
                           " when it was attached: detach it, attach it again");
  EXPECT_TRUE(sim.penalty().report(*body).finite);
  EXPECT_THROW(sim.penalty().synchronize(*body), std::logic_error) << "outside the step";

  sim.penalty().detach(*body);
  TetMesh larger = ball;
  larger.vertices.conservativeResize(3, size + 1);
  larger.vertices.col(size) = ball.vertices.col(0) + Vector3(0, 1, 0);
  sim.penalty().attach(*body, make_elastic_field(larger.vertices, larger.tetrahedra, 10.0));
  expect_recovered();
}

TEST_P(Held, ABodyWithAFaceOfAnotherOnesNode) {
  body->appendFace(0, 1, 2);
  const int face = body->m_faces.size() - 1;
  body->m_faces[face].m_n[1] = &others[0]->m_nodes[0];
  expect_at_rest();
  const std::string what = "face " + std::to_string(face) + ": its node 1 is none of this body";
  EXPECT_EQ(problem(), what + ": take it away");
  sim.penalty().detach(*body);
  EXPECT_EQ(complaint<std::invalid_argument>(
                [&] { sim.penalty().attach(*body, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0)); }),
            "attach: " + what);
  body->m_faces.pop_back();
  sim.penalty().attach(*body, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  expect_recovered();
}

TEST_P(Held, AConstraintThatThrows) {
  PotentialField moody(ball.vertices);
  moody.add<Moody>(edges_of(ball.tetrahedra), 1);
  sim.penalty().attach(*body, std::move(moody));
  step();
  EXPECT_EQ(problem(), "");
  Moody::mood = Mood::bad;
  expect_at_rest();
  EXPECT_EQ(problem(), "not today");
  Moody::mood = Mood::good;
  expect_recovered();
}

TEST_P(Held, WhateverIsThrown) {
  PotentialField moody(ball.vertices);
  moody.add<Moody>(edges_of(ball.tetrahedra), 1);
  sim.penalty().attach(*body, std::move(moody));
  Moody::mood = Mood::no_memory;
  expect_at_rest();
  EXPECT_EQ(problem(), std::bad_alloc().what());
  Moody::mood = Mood::number;
  expect_at_rest();
  EXPECT_EQ(problem(), "something was thrown that is no std::exception");
  Moody::mood = Mood::good;
  expect_recovered();
}

TEST_P(Held, AConstraintThatThrowsImplicitly) {
  PotentialField moody(ball.vertices);
  moody.add<Moody>(edges_of(ball.tetrahedra), 1);
  sim.penalty().attach(*body, std::move(moody), {.step = {.integrator = Integrator::implicit_step}});
  Moody::mood = Mood::bad;
  expect_at_rest();
  EXPECT_EQ(problem(), "not today");
  Moody::mood = Mood::good;
  expect_recovered();
}

// What a body hangs on: a rigid body that leaves the world, and a soft one that cannot be stepped.
class HeldTogether : public Held {
 protected:
  int tie(const CouplingPoint& a, const Vector3& at, btSoftBody& b) {
    Eigen::Matrix3Xd rest(3, 2);
    rest << at, to_vector(b.m_nodes[0].m_x);
    PotentialField rope(rest);
    rope.add<Length>(std::vector<Edge>{{0, 1}}, 50);
    return sim.penalty().couple({a, CouplingPoint::at_node(b, 0)}, std::move(rope), 0.01);
  }
};

TEST_P(HeldTogether, ACoupledRigidBodyThatLeftTheWorld) {
  btRigidBody& hook = sim.add_box({0.1, 0.1, 0.1}, 0, {0, 3, 0});
  const int rope = tie(CouplingPoint::on(hook, {0, 0, 0}), {0, 3, 0}, *body);
  step(5);
  EXPECT_EQ(problem(), "");
  sim.world().removeRigidBody(&hook);
  expect_at_rest();
  EXPECT_EQ(problem(), "a rigid body that it is coupled to has left the world: uncouple it, or put it back");

  sim.world().addRigidBody(&hook);
  step(30);
  EXPECT_EQ(problem(), "") << "put back";
  EXPECT_GT(lowest(*body), 0.1) << "and carried";
  EXPECT_GT(sim.penalty().coupling_energy(rope), 0);

  sim.world().removeRigidBody(&hook);
  expect_at_rest();
  sim.penalty().uncouple(rope);
  expect_recovered();
  sim.world().addRigidBody(&hook);
}

TEST_P(HeldTogether, ABodyCoupledToOneThatCannotBeStepped) {
  btSoftBody& upper = sim.add_jelly(ball, {.shift = {0, 3, 0}});
  tie(CouplingPoint::at_node(upper, 0), to_vector(upper.m_nodes[0].m_x), *body);
  upper.appendNode(btVector3(0, 4, 0), 1);
  expect_at_rest();
  EXPECT_EQ(problem(), "a body that it is coupled to cannot be stepped");
  sim.remove(upper);
  expect_recovered();
}

INSTANTIATE_TEST_SUITE_P(World, HeldTogether, both_worlds(), param_name);

// Rigid bodies fall on as if the soft body beside them were none of their business.
TEST_P(Held, RigidBodiesFallOn) {
  body->appendNode(btVector3(0, 2, 0), 1);
  const Real y = Real(boxes[0]->getWorldTransform().getOrigin().y()), v = Real(boxes[0]->getLinearVelocity().y());
  step(10);
  const Real t = 10 * frame;
  EXPECT_NEAR(Real(boxes[0]->getLinearVelocity().y()), v - 9.81 * t, 1e-4);
  EXPECT_NEAR(Real(boxes[0]->getWorldTransform().getOrigin().y()), y + v * t - 9.81 * t * t / 2, 0.02);
}

// Settings that are no numbers for some steps, on a body that falls: it waits, and falls on. Bullet would have switched
// it off.
class BadSetting : public Held {
 protected:
  template <class Set>
  void expect_wait(const Set& set, btScalar good, const std::string& what) {
    let_sleep(*body);  // Bullet switches off no body that never sleeps
    for (const btScalar bad : {nan, inf}) {
      set(bad);
      const std::vector<Vector3> before = places_of(*body);
      for (int k = 0; k < 3; ++k) {
        ASSERT_NO_THROW(sim.step(frame));
        without.step(frame);
        EXPECT_EQ(places_of(*body), before);
        EXPECT_EQ(problem(), what);
        EXPECT_FALSE(sim.penalty().report(*body).finite);
        EXPECT_TRUE(sim.penalty().particles(*body).velocities.allFinite());
        EXPECT_TRUE(body->isActive());
      }
      set(good);
      step(1);
      EXPECT_TRUE(sim.penalty().report(*body).finite);
      EXPECT_EQ(problem(), "");
      EXPECT_LT(sim.penalty().report(*body).substeps, 1000) << "and it costs no more than before";
    }
    expect_recovered();
  }
};

TEST_P(BadSetting, Margin) {
  expect_wait([&](btScalar x) { body->getCollisionShape()->setMargin(x); }, btScalar(0.02),
              "its collision margin is not finite");
}
TEST_P(BadSetting, Friction) {
  expect_wait([&](btScalar x) { body->m_cfg.kDF = x; }, btScalar(0.5), "its friction, m_cfg.kDF, is not finite");
}
TEST_P(BadSetting, GravityFactor) {
  expect_wait([&](btScalar x) { body->m_gravityFactor = x; }, 1, "its gravity factor is not finite");
}
TEST_P(BadSetting, Damping) {
  expect_wait([&](btScalar x) { body->m_cfg.kDP = x; }, 0, "m_cfg.kDP is not finite");
}
TEST_P(BadSetting, Drag) {
  expect_wait([&](btScalar x) { body->m_cfg.drag = x; }, 0, "m_cfg.drag is not finite");
}
TEST_P(BadSetting, Pressure) {
  expect_wait([&](btScalar x) { body->m_cfg.kPR = x; }, 0, "m_cfg.kPR is not finite");
}
TEST_P(BadSetting, Timescale) {
  expect_wait([&](btScalar x) { body->m_cfg.timescale = x; }, 1, "m_cfg.timescale is not finite");
}

INSTANTIATE_TEST_SUITE_P(World, BadSetting, both_worlds(), param_name);

// Friction of what the body lies on.
TEST_P(Held, FrictionOfAnObjectIsLeftOut) {
  for (int k = 0; k < 60 && sim.penalty().report(*body).num_contacts == 0; ++k) step();
  ASSERT_GT(sim.penalty().report(*body).num_contacts, 0);
  for (Simulation* s : {&sim, &without}) {
    btCollisionObject* ground = s->world().getCollisionObjectArray()[0];
    ground->setFriction(nan);
  }
  step();
  EXPECT_EQ(problem(), "the friction of an object that it touches is not finite, and was left out");
  EXPECT_LT(sim.penalty().report(*body).substeps, 1000);
  for (Simulation* s : {&sim, &without}) s->world().getCollisionObjectArray()[0]->setFriction(1);
  step();
  EXPECT_EQ(problem(), "");
}

INSTANTIATE_TEST_SUITE_P(World, Held, both_worlds(), param_name);

// The force for Bullet's own solver: it acts, or it does not and says why.
class HeldForce : public ::testing::TestWithParam<WorldKind> {};

TEST_P(HeldForce, NothingIsThrownThroughBullet) {
  Simulation sim(GetParam(), Solver::bullet);
  DeformablePenaltyForce force(0.01);
  const TetMesh ball = make_ball(0.25, 1);
  btSoftBody& moody = sim.add(make_soft_body(sim.info(), ball, {.stock_deformable = true}));
  btSoftBody& grown = sim.add(make_soft_body(sim.info(), moved(ball, {3, 0, 0}), {.stock_deformable = true}));
  btSoftBody& fine = sim.add(make_soft_body(sim.info(), moved(ball, {6, 0, 0}), {.stock_deformable = true}));
  PotentialField field(ball.vertices);
  field.add<Moody>(edges_of(ball.tetrahedra), 1);
  force.attach(moody, std::move(field));
  for (btSoftBody* body : {&grown, &fine}) force.attach(*body, make_elastic_field(ball.vertices, ball.tetrahedra, 1.0));
  for (btSoftBody* body : {&moody, &grown, &fine}) sim.deformable_world().addForce(body, &force);
  for (btSoftBody* body : {&moody, &fine}) {
    body->m_nodes[0].m_x += btVector3(btScalar(0.05), 0, 0);
    body->m_nodes[0].m_q = body->m_nodes[0].m_x;
  }
  grown.appendNode(btVector3(3, 1, 0), 1);
  grown.appendLink(0, 13);  // without it Bullet's tree of nodes is never finished
  Moody::mood = Mood::bad;
  ASSERT_NO_THROW(sim.step(1.0 / 4096));
  ASSERT_NO_THROW(force.totalEnergy(btScalar(1.0 / 4096)));
  EXPECT_EQ(force.problem(moody), "not today");
  EXPECT_EQ(force.problem(grown), "the soft body has 14 nodes, had 13 when it was attached");
  EXPECT_EQ(force.problem(fine), "");
  EXPECT_EQ(fastest(moody) + fastest(grown), 0);
  EXPECT_GT(fastest(fine), 0);
  Moody::mood = Mood::good;
  sim.step(1.0 / 4096);
  EXPECT_EQ(force.problem(moody), "");
  EXPECT_GT(fastest(moody), 0);
  for (btSoftBody* body : {&moody, &grown, &fine}) sim.remove(*body);
}

INSTANTIATE_TEST_SUITE_P(World, HeldForce, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
