// What an application does to a body between steps takes effect, once.
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <functional>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Application : public WorldTest {
 protected:
  // Two particles of 0.5 and 2 kg without any force between them: every motion has a closed form.
  btSoftBody& add_free_particles() {
    const btVector3 positions[] = {{0, 0, 0}, {1, 0, 0}};
    const btScalar masses[] = {btScalar(0.5), 2};
    btSoftBody& body = sim.add(std::make_unique<btSoftBody>(&sim.info(), 2, positions, masses));
    Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 2);
    rest(0, 1) = 1;
    sim.penalty().attach(body, PotentialField(rest));
    return body;
  }

  void expect_particle(const btSoftBody& body, int i, const Vector3& x, const Vector3& v) {
    const Particles& p = sim.penalty().particles(body);
    EXPECT_LT((p.positions.col(i).head<3>() - x).norm(), 1e-12) << "particle " << i;
    EXPECT_LT((p.velocities.col(i).head<3>() - v).norm(), 1e-12) << "particle " << i;
    EXPECT_LT((to_vector(body.m_nodes[i].m_x) - x).norm(), limit(1e-12, 1e-6)) << "node " << i;
    EXPECT_LT((to_vector(body.m_nodes[i].m_v) - v).norm(), limit(1e-12, 1e-6)) << "node " << i;
  }
};

TEST_P(Application, ANodesVelocityCanBeSet) {
  btSoftBody& body = add_free_particles();
  sim.step(exact_frame, 4);
  body.m_nodes[0].m_v = btVector3(1, 2, -4);
  sim.step(exact_frame, 16);
  expect_particle(body, 0, Vector3(1, 2, -4) / 4, {1, 2, -4});
  expect_particle(body, 1, {1, 0, 0}, {0, 0, 0});
  body.m_nodes[0].m_v += btVector3(0, 0, 8);
  sim.step(exact_frame, 16);
  expect_particle(body, 0, Vector3(2, 4, 0) / 4, {1, 2, 4});
}

TEST_P(Application, ANodeCanBeMoved) {
  btSoftBody& body = add_free_particles();
  body.m_nodes[1].m_v = btVector3(0, 1, 0);
  sim.step(exact_frame, 16);
  body.m_nodes[1].m_x += btVector3(0, 0, btScalar(0.5));
  sim.step(exact_frame, 16);
  expect_particle(body, 1, {1, 0.5, 0.5}, {0, 1, 0});
}

TEST_P(Application, SynchronizeShowsAChangeBeforeTheNextStep) {
  btSoftBody& body = add_free_particles();
  body.m_nodes[1].m_x = btVector3(1, 2, 3);
  body.m_nodes[1].m_v = btVector3(3, 2, 1);
  EXPECT_EQ(sim.penalty().particles(body).positions(1, 1), 0);
  sim.penalty().synchronize(body);
  expect_particle(body, 1, {1, 2, 3}, {3, 2, 1});
  sim.penalty().synchronize(body);  // once is enough
  expect_particle(body, 1, {1, 2, 3}, {3, 2, 1});
}

// As under Bullet alone a force lasts for one of Bullet's steps: dv = F dt / m, and F dt² / 2m on the way.
TEST_P(Application, AddForceActsForOneStep) {
  btSoftBody& body = add_free_particles();
  body.addForce(btVector3(0, 0, 64), 0);
  sim.step(exact_frame);
  expect_particle(body, 0, {0, 0, 64 * exact_frame * exact_frame / 2 / 0.5}, {0, 0, 2});
  expect_particle(body, 1, {1, 0, 0}, {0, 0, 0});
  sim.step(exact_frame);
  expect_particle(body, 0, {0, 0, 1.0 / 64 + 2 * exact_frame}, {0, 0, 2});
}

TEST_P(Application, AForceInEveryStepIsAConstantForce) {
  btSoftBody& body = add_free_particles();
  for (int step = 0; step < 64; ++step) {
    body.addForce(btVector3(0, 4, 0), 1);
    sim.step(exact_frame);
  }
  expect_particle(body, 1, {1, 1, 0}, {0, 2, 0});
}

TEST_P(Application, GravityFactorScalesGravity) {
  sim.set_gravity({0, -8, 0});
  btSoftBody& body = add_free_particles();
  body.m_gravityFactor = btScalar(0.25);
  sim.step(exact_frame, 64);
  expect_particle(body, 0, {0, -1, 0}, {0, -2, 0});
  body.m_gravityFactor = 0;
  sim.step(exact_frame, 64);
  expect_particle(body, 0, {0, -3, 0}, {0, -2, 0});
}

TEST_P(Application, AMassOfZeroPinsWhileRunningAndAMassUnpins) {
  sim.set_gravity({0, -8, 0});
  btSoftBody& body = add_free_particles();
  sim.step(exact_frame, 16);
  expect_particle(body, 0, {0, -0.25, 0}, {0, -2, 0});
  body.setMass(0, 0);
  body.m_nodes[0].m_v.setZero();
  sim.step(exact_frame, 16);
  expect_particle(body, 0, {0, -0.25, 0}, {0, 0, 0});
  expect_particle(body, 1, {1, -1, 0}, {0, -4, 0});
  body.setMass(0, btScalar(0.5));
  sim.step(exact_frame, 16);
  expect_particle(body, 0, {0, -0.5, 0}, {0, -2, 0});
}

TEST_P(Application, APinnedNodeFollowsTheVelocityItIsGiven) {
  sim.set_gravity({0, -8, 0});
  btSoftBody& body = add_free_particles();
  body.setMass(1, 0);
  body.m_nodes[1].m_v = btVector3(0, 1, 2);
  sim.step(exact_frame, 64);
  expect_particle(body, 1, {1, 1, 2}, {0, 1, 2});
}

TEST_P(Application, APinnedBodyHangsOn) {
  sim.set_gravity({0, -9.81, 0});
  const TetMesh beam = make_box({1, 0.2, 0.2}, {10, 2, 2});
  SoftBodyOptions options;
  for (int i = 0; i < beam.vertices.cols(); ++i)
    if (beam.vertices(0, i) < 1e-9) options.pinned.push_back(i);
  ASSERT_EQ(options.pinned.size(), 9u);
  btSoftBody& body =
      sim.add_jelly(beam, {.stiffness = 20, .body = options, .attach = {.step = {.damping_time = 0.02}}});
  const PackedVectors start = sim.penalty().particles(body).positions;
  sim.step(1.0 / 60, 120);
  for (const int i : options.pinned) {
    EXPECT_EQ(sim.penalty().particles(body).positions.col(i), start.col(i)) << "node " << i;
    EXPECT_NEAR((start.col(i).head<3>() - beam.vertices.col(i)).norm(), 0, 1e-7) << "a rounding of float";
  }
  EXPECT_LT(lowest(body), -0.01) << "sags";
  EXPECT_GT(lowest(body), -0.5);
}

TEST_P(Application, ChangedMassesCountForTheSubsteps) {
  btSoftBody& body = sim.add_jelly(make_ball(0.25, 2));
  sim.step(exact_frame);
  const int before = sim.penalty().report(body).substeps;
  for (int i = 0; i < body.m_nodes.size(); ++i) body.setMass(i, 100 / body.m_nodes[i].m_im);
  sim.step(exact_frame);
  EXPECT_EQ(sim.penalty().report(body).substeps, before) << "lighter would need more, heavier may keep them";
  sim.penalty().refresh(body);
  sim.step(exact_frame, 40);
  EXPECT_NEAR(sim.penalty().report(body).substeps, before / 10.0, 3);
  for (int i = 0; i < body.m_nodes.size(); ++i) body.setMass(i, btScalar(0.01) / body.m_nodes[i].m_im);
  sim.step(exact_frame);
  EXPECT_NEAR(sim.penalty().report(body).substeps, before, 3);
}

// Without the ground under it a body falls freely: 1 s, 4.9 m.
class Untouched : public Application {
 protected:
  void SetUp() override {
    sim.set_gravity({0, -9.81, 0});
    ground = &sim.add_ground();
    body = &sim.add_jelly(make_ball(0.25, 2), {.shift = {0, 0.5, 0}});
  }

  void expect_through() {
    sim.step(exact_frame, 64);
    EXPECT_NEAR(center_of_mass(sim.penalty().particles(*body)).y(), 0.5 - 9.81 / 2, 1e-5);
    EXPECT_EQ(sim.penalty().report(*body).num_contacts, 0);
  }

  btRigidBody* ground = nullptr;
  btSoftBody* body = nullptr;
};

TEST_P(Untouched, ButNotWithoutAReason) {
  sim.step(exact_frame, 64);
  EXPECT_GT(lowest(*body), 0);
}

TEST_P(Untouched, ObjectsWithoutContactResponse) {
  ground->setCollisionFlags(ground->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  expect_through();
}

TEST_P(Untouched, BodiesWithoutContactResponse) {
  body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  expect_through();
}

TEST_P(Untouched, GroupsThatAreFilteredOutByTheObject) {
  ground->getBroadphaseHandle()->m_collisionFilterMask &= ~body->getBroadphaseHandle()->m_collisionFilterGroup;
  expect_through();
}

TEST_P(Untouched, GroupsThatAreFilteredOutByTheBody) {
  body->getBroadphaseHandle()->m_collisionFilterMask &= ~ground->getBroadphaseHandle()->m_collisionFilterGroup;
  expect_through();
}

TEST_P(Untouched, PairsThatIgnoreEachOther) {
  ground->setIgnoreCollisionCheck(body, true);
  expect_through();
}

TEST_P(Untouched, ObjectsThatTheBodyDisabled) {
  body->m_collisionDisabledObjects.push_back(ground);
  expect_through();
}

INSTANTIATE_TEST_SUITE_P(World, Untouched, both_worlds(), param_name);

// Calls at the end of the next world step, from within it.
void at_end_of_step(btDynamicsWorld& world, std::function<void()>& call) {
  world.setInternalTickCallback(
      [](btDynamicsWorld* of, btScalar) { (*static_cast<std::function<void()>*>(of->getWorldUserInfo()))(); }, &call);
}

TEST_P(Application, ARigidBodyTakenOutAtTheEndOfAStepIsLeftAlone) {
  sim.set_gravity({0, -10, 0});
  sim.add_ground();
  sim.add_jelly(make_box({1, 0.5, 1}, {4, 2, 4}), {.shift = {0, 0.02, 0}});
  btRigidBody& box = sim.add_box({0.2, 0.2, 0.2}, 1, {0.5, 0.8, 0.5});
  box.setLinearVelocity({0, -5, 0});
  btTransform then = box.getWorldTransform();
  std::function<void()> take_out = [&] {
    if (box.getLinearVelocity().y() < -4.5) return;  // it has not hit yet
    sim.world().removeRigidBody(&box);
    then = box.getWorldTransform();
    take_out = [] {};
  };
  at_end_of_step(sim.world(), take_out);
  sim.step(exact_frame, 16);
  ASSERT_FALSE(box.isInWorld());
  EXPECT_EQ(box.getWorldTransform(), then);
}

// Bullet's deformable world calls before it solves, and follows rigid bodies that are gone by then.
TEST_P(Application, BodiesDeletedAtTheEndOfAStepAreForgotten) {
  sim.set_gravity({0, -10, 0});
  sim.add_ground();
  btSoftBody& jelly = sim.add_jelly(make_box({1, 0.5, 1}, {4, 2, 4}), {.shift = {0, 0.02, 0}});
  btSoftBody& other = sim.add_jelly(make_box({1, 0.5, 1}, {4, 2, 4}), {.shift = {3, 0.02, 0}});
  btRigidBody& box = sim.add_box({0.2, 0.2, 0.2}, 1, {0.5, 0.74, 0.5});
  int steps = 0;
  std::function<void()> remove = [&] {
    if (++steps != 4) return;
    if (GetParam() == WorldKind::classic) sim.remove(box);
    sim.remove(jelly);
  };
  at_end_of_step(sim.world(), remove);
  sim.step(exact_frame, 16);
  EXPECT_EQ(sim.world().getNumCollisionObjects(), GetParam() == WorldKind::classic ? 2 : 3);
  EXPECT_TRUE(sim.penalty().is_attached(other));
  EXPECT_GT(lowest(other), 0.019);
}

// Of a body that is not attached Bullet solves the constraints after that callback.
TEST_P(Application, ASoftBodyTakenOutAtTheEndOfAStepIsLeftAlone) {
  sim.set_gravity({0, -10, 0});
  std::unique_ptr<btSoftBody> made(
      btSoftBodyHelpers::CreateRope(sim.info(), btVector3(0, 0, 0), btVector3(2, 0, 0), 2, 1));
  btSoftBody& rope = sim.add(std::move(made));
  std::unique_ptr<btSoftBody> taken;
  btVector3 then;
  std::function<void()> take_out = [&] {
    if (taken) return;
    taken = sim.take_out(rope);
    then = taken->m_nodes[1].m_x;
  };
  at_end_of_step(sim.world(), take_out);
  sim.step(exact_frame, 4);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->m_nodes[1].m_x, then);
}

TEST_P(Application, ARigidBodyCanBeRemovedFromUnderASoftOne) {
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  btRigidBody& table = sim.add_box({0.5, 0.25, 0.5}, 3, {0, 0.25, 0});
  btSoftBody& body =
      sim.add_jelly(make_ball(0.25, 2), {.shift = {0, 0.8, 0}, .attach = {.step = {.damping_time = 0.01}}});
  sim.step(1.0 / 60, 60);
  ASSERT_GT(sim.penalty().report(body).num_contacts, 0);
  ASSERT_GT(lowest(body), 0.5);
  sim.remove(table);
  sim.step(1.0 / 60, 10);
  EXPECT_LT(lowest(body), 0.45) << "falls";
  sim.add_box({0.1, 0.1, 0.1}, 1, {0, 1.5, 0});  // perhaps where the other was in memory
  sim.step(1.0 / 60, 100);
  EXPECT_GT(lowest(body), 0);
  EXPECT_TRUE(sim.penalty().report(body).finite);
}

INSTANTIATE_TEST_SUITE_P(World, Application, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
