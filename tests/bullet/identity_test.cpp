// A body is known by what it carries, not by its address: bodies deleted without `detach`, and what is built on their
// ruins.
#include <cstring>
#include <new>

#include "bullet/simulation.h"
#include "penalty/bullet/deformable_penalty_force.h"

namespace penalty::testing {
namespace {

// Memory for one soft body after another, with what the last one left in it.
class Plot {
 public:
  explicit Plot(int leftover = 0xa5) { std::memset(memory_, leftover, sizeof(memory_)); }
  ~Plot() { clear(); }

  // Two particles a metre apart, 1 kg each.
  btSoftBody& build(btSoftBodyWorldInfo& info, Real height = 0) {
    clear();
    const auto y = static_cast<btScalar>(height);
    const btVector3 positions[] = {{0, y, 0}, {1, y, 0}};
    const btScalar masses[] = {1, 1};
    body_ = ::new (static_cast<void*>(memory_)) btSoftBody(&info, 2, positions, masses);
    body_->setActivationState(DISABLE_DEACTIVATION);
    return *body_;
  }

  btSoftBody& body() { return *body_; }

  void clear() {
    if (body_) body_->~btSoftBody();
    body_ = nullptr;
  }

 private:
  alignas(16) unsigned char memory_[sizeof(btSoftBody)];
  btSoftBody* body_ = nullptr;
};

// A spring that is at rest at `length`.
PotentialField spring(Real length, Real stiffness = 10) {
  Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 2);
  rest(0, 1) = length;
  PotentialField field(rest);
  field.add<Length>(std::vector<Edge>{{0, 1}}, stiffness);
  return field;
}

Real length_of(const btSoftBody& body) { return Real((body.m_nodes[1].m_x - body.m_nodes[0].m_x).length()); }

class Identity : public WorldTest {
 protected:
  demo::BulletWorld world{GetParam()};
  AttachedBodies& penalty = world.attached();
  Plot plot;
};

TEST_P(Identity, ABodyAtTheAddressOfADeletedOneIsNotAttached) {
  world.set_gravity({0, 0, 0});
  btSoftBody& first = plot.build(world.info());
  world.add(first);
  penalty.attach(first, spring(2));
  world.step(frame);
  world.remove(first);
  btSoftBody& second = plot.build(world.info());
  ASSERT_EQ(&first, &second);
  EXPECT_FALSE(penalty.is_attached(second));
  EXPECT_THROW(penalty.particles(second), std::invalid_argument);
  world.add(second);
  world.step(frame);
  EXPECT_EQ(length_of(second), 1) << "no field acts";
  world.remove(second);
}

TEST_P(Identity, TheNextBodyHasItsOwnFieldAlone) {
  world.set_gravity({0, 0, 0});
  for (const bool stepped_between : {false, true}) {
    btSoftBody& first = plot.build(world.info());
    penalty.attach(first, spring(2));
    world.add(first);
    world.step(frame);
    world.remove(first);
    btSoftBody& second = plot.build(world.info());
    world.add(second);
    if (stepped_between) world.step(frame);
    penalty.attach(second, spring(1));
    EXPECT_EQ(penalty.field(second).num_elements(), 1u);
    for (int step = 0; step < 30; ++step) world.step(frame);
    EXPECT_EQ(length_of(second), 1) << "at rest where it is";
    world.remove(second);
  }
}

TEST_P(Identity, LeftoversInMemoryAreNoIdentity) {
  for (const int leftover : {0x00, 0x01, 0xff}) {
    Plot ruin(leftover);
    const btSoftBody& body = ruin.build(world.info());
    EXPECT_FALSE(penalty.is_attached(body));
  }
}

// A hundred bodies, none of them detached, each at rest at a length of its own.
TEST_P(Identity, AttachAndForgetGoesOnForEver) {
  world.set_gravity({0, 0, 0});
  std::set<std::uintptr_t> serials;
  for (int k = 0; k < 100; ++k) {
    btSoftBody& body = plot.build(world.info());
    world.add(body);
    serials.insert(penalty.attach(body, spring(1 + k, 1e-3)).serial_number());
    EXPECT_EQ(penalty.field(body).num_elements(), 1u);
    EXPECT_EQ(penalty.field(body).rest_positions()(0, 1), 1 + k);
    world.step(frame);
    world.remove(body);
  }
  EXPECT_EQ(serials.size(), 100u);
}

TEST_P(Identity, WhatTheApplicationOwnsStaysItsOwn) {
  int mine = 0;
  btSoftBody& body = plot.build(world.info());
  body.setUserPointer(&mine);
  body.setUserIndex(5);
  body.setUserIndex2(6);
  body.setUserIndex3(7);
  body.m_tag = &mine;
  const int materials = body.m_materials.size();
  penalty.attach(body, spring(1));
  EXPECT_EQ(body.getUserPointer(), &mine);
  EXPECT_EQ(body.getUserIndex(), 5);
  EXPECT_EQ(body.getUserIndex2(), 6);
  EXPECT_EQ(body.getUserIndex3(), 7);
  EXPECT_EQ(body.m_tag, &mine);
  EXPECT_EQ(body.m_materials.size(), materials);
  EXPECT_EQ(body.m_notes.size() + body.m_userIndexMapping.size() + body.m_collisionDisabledObjects.size(), 0);
  body.setUserPointer(nullptr);
  body.setUserIndex(-1);
  EXPECT_TRUE(penalty.is_attached(body)) << "and may be changed";
}

TEST_P(Identity, TheHandleSaysWhenTheBodyIsGone) {
  btSoftBody& body = plot.build(world.info());
  const AttachedBody handle = penalty.attach(body, spring(1));
  EXPECT_FALSE(handle.is_gone()) << "not yet in the world";
  world.add(body);
  world.step(frame);
  EXPECT_FALSE(handle.is_gone());
  world.remove(body);
  plot.clear();
  world.step(frame);
  EXPECT_TRUE(handle.is_gone());

  btSoftBody& next = plot.build(world.info());
  const AttachedBody other = penalty.attach(next, spring(1));
  EXPECT_NE(other.serial_number(), handle.serial_number());
  EXPECT_TRUE(handle.is_gone());
  EXPECT_FALSE(other.is_gone());
  penalty.detach(next);
  EXPECT_TRUE(other.is_gone());
}

TEST_P(Identity, ABodyThatIsPutBackIsThereAgain) {
  btSoftBody& body = plot.build(world.info());
  world.add(body);
  const AttachedBody handle = penalty.attach(body, spring(1));
  world.step(frame);
  world.remove(body);
  world.step(frame);
  EXPECT_TRUE(handle.is_gone());
  world.add(body);
  world.step(frame);
  EXPECT_FALSE(handle.is_gone());
  EXPECT_TRUE(penalty.is_attached(body));
  world.remove(body);
}

TEST_P(Identity, TheHandleOutlivesTheSolver) {
  auto other = std::make_unique<demo::BulletWorld>(GetParam());
  btSoftBody& body = plot.build(other->info());
  const AttachedBody handle = other->attached().attach(body, spring(1));
  EXPECT_FALSE(handle.is_gone());
  plot.clear();
  other.reset();
  EXPECT_TRUE(handle.is_gone());
}

TEST_P(Identity, BodiesOutliveTheSolverOrNot) {
  for (const bool body_first : {true, false}) {
    auto other = std::make_unique<demo::BulletWorld>(GetParam());
    btSoftBody& body = plot.build(other->info());
    other->add(body);
    other->attached().attach(body, spring(1));
    other->step(frame);
    other->remove(body);
    if (body_first) plot.clear();
    other.reset();
    plot.clear();
  }
}

TEST_P(Identity, TwoSolversKnowTheSameBody) {
  demo::BulletWorld other(GetParam());
  btSoftBody& body = plot.build(world.info());
  const AttachedBody here = penalty.attach(body, spring(1)), there = other.attached().attach(body, spring(2));
  EXPECT_EQ(here.serial_number(), there.serial_number());
  penalty.detach(body);
  EXPECT_FALSE(penalty.is_attached(body));
  EXPECT_TRUE(other.attached().is_attached(body));
  btSoftBody& next = plot.build(world.info());
  EXPECT_FALSE(other.attached().is_attached(next));
}

// A body on the ground under a second one that hangs on it; the first is deleted.
class CoupledIdentity : public Identity {
 protected:
  int tie(btSoftBody& a, btSoftBody& b) {
    Eigen::Matrix3Xd rest(3, 2);
    rest << to_vector(a.m_nodes[0].m_x), to_vector(b.m_nodes[0].m_x);
    PotentialField rope(rest);
    rope.add<Length>(std::vector<Edge>{{0, 1}}, 100);
    return penalty.couple({CouplingPoint::at_node(a, 0), CouplingPoint::at_node(b, 0)}, std::move(rope));
  }

  void fall_free(const btSoftBody& body, Real from) {
    const Real speed = Real(body.m_nodes[0].m_v.y());
    for (int step = 0; step < 60; ++step) world.step(frame);
    EXPECT_NEAR(Real(body.m_nodes[0].m_x.y()), from + speed - 9.81 / 2, 1e-3);
  }

  Plot neighbour;
};

TEST_P(CoupledIdentity, ACouplingToAGoneBodyIsDroppedInSilence) {
  for (const bool replaced : {false, true}) {
    world.set_gravity({0, 0, 0});
    btSoftBody& gone = plot.build(world.info(), 2);
    btSoftBody& left = neighbour.build(world.info());
    for (btSoftBody* body : {&gone, &left}) {
      world.add(*body);
      penalty.attach(*body, spring(1));
    }
    const int rope = tie(gone, left);
    world.step(frame);
    world.remove(gone);
    plot.clear();
    if (replaced) world.add(plot.build(world.info(), 7));
    world.set_gravity({0, btScalar(-9.81), 0});
    fall_free(left, Real(left.m_nodes[0].m_x.y()));
    EXPECT_EQ(penalty.report(left).problem, "");
    if (replaced) {
      EXPECT_THROW(penalty.coupling_field(rope), std::invalid_argument);
      EXPECT_NO_THROW(penalty.uncouple(rope)) << "as where the entry is still there";
      world.remove(plot.body());
    } else {
      penalty.edit_coupling(rope);
      world.step(frame);
      penalty.uncouple(rope);
      world.step(frame);
    }
    penalty.detach(left);
    world.remove(left);
  }
}

TEST_P(CoupledIdentity, ACoupledBodyThatIsPutBackHangsOnAgain) {
  world.set_gravity({0, 0, 0});
  btSoftBody& away = plot.build(world.info(), 1);
  btSoftBody& here = neighbour.build(world.info());
  for (btSoftBody* body : {&away, &here}) {
    world.add(*body);
    penalty.attach(*body, spring(1));
  }
  const int rope = tie(away, here);
  world.step(frame);
  world.remove(away);
  for (int k = 0; k < 3; ++k) world.step(frame);
  world.add(away);
  for (int i = 0; i < 2; ++i) here.m_nodes[i].m_v = btVector3(0, -1, 0);
  for (int k = 0; k < 60; ++k) world.step(frame);
  EXPECT_LT(Real(away.m_nodes[0].m_x.y()), 0.9) << "dragged along";
  EXPECT_GT(penalty.coupling_energy(rope), 0);
  for (btSoftBody* body : {&away, &here}) world.remove(*body);
}

TEST_P(CoupledIdentity, ARigidBodyThatWasDeletedIsNeverFollowed) {
  world.set_gravity({0, 0, 0});
  btSoftBody& body = plot.build(world.info());
  world.add(body);
  penalty.attach(body, spring(1));
  btBoxShape shape(btVector3(1, 1, 1));
  alignas(16) unsigned char memory[sizeof(btRigidBody)];
  auto* box = ::new (static_cast<void*>(memory)) btRigidBody(0, nullptr, &shape);
  box->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 9, 0)));
  world.world().addRigidBody(box);
  Eigen::Matrix3Xd rest(3, 2);
  rest << 0, 0, 0, 9, 0, 0;
  PotentialField rope(rest);
  rope.add<Length>(std::vector<Edge>{{0, 1}}, 100);
  const int coupling =
      penalty.couple({CouplingPoint::at_node(body, 0), CouplingPoint::on(*box, {0, 0, 0})}, std::move(rope));
  world.step(frame);
  world.world().removeRigidBody(box);
  box->~btRigidBody();
  std::memset(memory, 0xff, sizeof(memory));
  world.step(frame);
  EXPECT_EQ(penalty.report(body).problem,
            "a rigid body that it is coupled to has left the world: uncouple it, or put it back");
  penalty.uncouple(coupling);
  body.m_nodes[0].m_v = body.m_nodes[1].m_v = btVector3(0, 0, 1);
  world.step(frame);
  EXPECT_EQ(penalty.report(body).problem, "");
  EXPECT_GT(body.m_nodes[0].m_x.z(), 0);
  world.remove(body);
}

INSTANTIATE_TEST_SUITE_P(World, Identity, both_worlds(), param_name);
INSTANTIATE_TEST_SUITE_P(World, CoupledIdentity, both_worlds(), param_name);

// The force for Bullet's own solver knows its bodies in the same way.
class ForceIdentity : public ::testing::TestWithParam<WorldKind> {};

TEST_P(ForceIdentity, ABodyAtTheAddressOfADeletedOneFeelsNothing) {
  demo::BulletWorld world(GetParam(), Solver::bullet);
  world.set_gravity({0, 0, 0});
  DeformablePenaltyForce force;
  Plot plot;
  btSoftBody* body = &plot.build(world.info());
  world.add(*body);
  force.attach(*body, spring(2));
  world.deformable().addForce(body, &force);
  world.step(1.0 / 4096);
  EXPECT_GT(force.totalElasticEnergy(0), 1);
  world.remove(*body);
  body = &plot.build(world.info());
  world.add(*body);
  world.deformable().addForce(body, &force);
  EXPECT_EQ(force.totalElasticEnergy(0), 0) << "not attached yet";
  world.step(1.0 / 4096);
  EXPECT_EQ(length_of(*body), 1);
  force.attach(*body, spring(1));
  EXPECT_EQ(force.totalElasticEnergy(0), 0) << "at rest in its own field";
  world.step(1.0 / 4096);
  EXPECT_EQ(length_of(*body), 1);
  world.remove(*body);
}

INSTANTIATE_TEST_SUITE_P(World, ForceIdentity, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
