#include "rigid_joints.h"

#include <BulletDynamics/ConstraintSolver/btTypedConstraint.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <cmath>
#include <utility>

#include "convert.h"
#include "world_island.h"

namespace penalty {
namespace {

void write_feedback(btJointFeedback& feedback, const Joint& joint, Real duration) {
  feedback.m_appliedForceBodyA = to_bullet(Vector3(joint.impulse_a / duration));
  feedback.m_appliedTorqueBodyA = to_bullet(Vector3(joint.moment_a / duration));
  feedback.m_appliedForceBodyB = to_bullet(Vector3(joint.impulse_b / duration));
  feedback.m_appliedTorqueBodyB = to_bullet(Vector3(joint.moment_b / duration));
}

// Bullet's: that of the last row.
Real applied_impulse(const Joint& joint) { return joint.num_rows > 0 ? joint.given[joint.num_rows - 1] : 0; }

}  // namespace

void RigidJoints::take_from(btDiscreteDynamicsWorld& world) {
  world_ = &world;
  world.removeAction(this);  // which a new world at an old address has not
  world.addAction(this);
}

void RigidJoints::list() {
  joints_.clear();
  for (int k = 0; world_ && k < world_->getNumConstraints(); ++k) {
    btTypedConstraint* constraint = world_->getConstraint(k);
    if (!constraint->isEnabled() || &constraint->getRigidBodyA() == &constraint->getRigidBodyB()) continue;
    for (const btRigidBody* body : {&constraint->getRigidBodyA(), &constraint->getRigidBodyB()})
      if (body->getBroadphaseHandle()) joints_[body->getBroadphaseHandle()->m_uniqueId].push_back(constraint);
  }
}

const std::vector<btTypedConstraint*>& RigidJoints::of(int key) const {
  static const std::vector<btTypedConstraint*> none;
  const auto found = joints_.find(key);
  return found == joints_.end() ? none : found->second;
}

const btContactSolverInfo& RigidJoints::solver_info() const { return world_->getSolverInfo(); }

Joint RigidJoints::joint_of(const btTypedConstraint& constraint, int a, int b) const {
  Joint joint{.a = a, .b = b};
  if (const Real strength = constraint.getBreakingImpulseThreshold(); strength < Real(SIMD_INFINITY))
    joint.strength = std::max<Real>(strength, 0);
  if (const auto known = last_.find(&constraint); known != last_.end()) {
    joint.num_rows = known->second.num_rows;
    joint.forces = known->second.forces;
  }
  return joint;
}

void RigidJoints::remember(const std::vector<WorldIsland>& islands, Real duration) {
  duration_ = duration;
  solved_.clear();
  last_.clear();
  for (const WorldIsland& island : islands)
    for (const HeldJoint& held : island.joints) {
      if (held.joint.asks) solved_.push_back(held);
      last_[held.constraint] = held.joint;
    }
}

void RigidJoints::hide() {
  for (const HeldJoint& held : solved_)
    if (is_in_world(held.constraint) && held.constraint->isEnabled()) {
      held.constraint->setEnabled(false);
      hidden_.push_back(held);
    }
  solved_.clear();
}

void RigidJoints::show() {
  for (const auto& [constraint, a, b, joint] : hidden_) {
    if (!is_in_world(constraint)) continue;
    constraint->setEnabled(!joint.is_broken);
    constraint->internalSetAppliedImpulse(static_cast<btScalar>(applied_impulse(joint)));
    if (btJointFeedback* feedback = constraint->getJointFeedback()) write_feedback(*feedback, joint, duration_);
  }
  hidden_.clear();
}

bool RigidJoints::is_in_world(const btTypedConstraint* constraint) const {
  for (int k = 0; k < world_->getNumConstraints(); ++k)
    if (world_->getConstraint(k) == constraint) return true;
  return false;
}

std::vector<std::vector<btCollisionObject*>> RigidJoints::pairs() const {
  std::vector<std::vector<btCollisionObject*>> pairs;
  for (int k = 0; !last_.empty() && k < world_->getNumConstraints(); ++k) {
    btTypedConstraint& constraint = *world_->getConstraint(k);
    btRigidBody &a = constraint.getRigidBodyA(), &b = constraint.getRigidBodyB();
    if (last_.contains(&constraint) && constraint.isEnabled() && a.getBroadphaseHandle() && b.getBroadphaseHandle())
      pairs.push_back({&a, &b});
  }
  return pairs;
}

void RigidJoints::updateAction(btCollisionWorld*, btScalar) { show(); }
void RigidJoints::debugDraw(btIDebugDraw*) {}

}  // namespace penalty
