#include "sleeping.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "body_anchors.h"
#include "convert.h"
#include "couplings.h"
#include "held_bodies.h"
#include "obstacles.h"
#include "rigid_joints.h"
#include "world_island.h"
#include "world_objects.h"

namespace penalty {
namespace {

bool can_sleep(const btCollisionObject& object) {
  return !object.isStaticOrKinematicObject() &&
         (object.getActivationState() == WANTS_DEACTIVATION || object.getActivationState() == ISLAND_SLEEPING);
}

bool is_restless(const btCollisionObject& object) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (body && body->isStaticOrKinematicObject())
    return body->isKinematicObject() && !(body->getLinearVelocity().isZero() && body->getAngularVelocity().isZero());
  return object.isActive() && !can_sleep(object);
}

}  // namespace

void update_activation(HeldBody& held, Real duration) {
  btSoftBody& body = *held.body;
  if (held.outcome == StepOutcome::stepped) {
    const PackedVectors& now = held.stepped.particles.positions;
    Real furthest2 = 0;
    for (int i = 0; i < held.stepped.particles.size(); ++i)
      furthest2 = std::max(furthest2, (now.col(i) - held.start.col(i)).squaredNorm());
    body.m_maxSpeedSquared = static_cast<btScalar>(furthest2 / (duration * duration));
  }
  body.updateDeactivation(static_cast<btScalar>(duration));
  if (body.getActivationState() == DISABLE_DEACTIVATION || body.getActivationState() == DISABLE_SIMULATION) return;
  body.setActivationState(body.wantsSleeping() ? WANTS_DEACTIVATION : ACTIVE_TAG);
}

void wake_if_hit(btSoftBody& body) {
  // After a step of a duration that is no number.
  if (!std::isfinite(body.getDeactivationTime())) body.setDeactivationTime(0);
  if (body.getActivationState() != ISLAND_SLEEPING) return;
  Box box;
  for (int i = 0; i < body.m_nodes.size(); ++i) box.add(to_vector(body.m_nodes[i].m_x));
  const Real margin = body.getCollisionShape()->getMargin(), waking = waking_speed((box.high - box.low).norm());
  for (btCollisionObject* object : obstacles_near(body, box, margin)) {
    const btRigidBody* rigid = btRigidBody::upcast(object);
    if (!object->isActive() || (rigid && stands_still(*rigid))) continue;
    const Real speed = rigid ? Real(rigid->getLinearVelocity().length()) : link_velocities(*object)[0].norm();
    if (speed > waking && bounds_of(*object).overlaps(box, 2 * margin)) body.activate(true);
  }
}

void wait_for_carried(const HeldBody& held, const WorldIsland& island) {
  for (const TouchedRigidBody& touched : island.touched)
    if (touched.start.is_dynamic() && touched.object->getActivationState() != WANTS_DEACTIVATION &&
        !is_anchored(held, *touched.object))
      held.body->setDeactivationTime(0);
}

void keep_awake_together(const Couplings& couplings, const RigidJoints& joints, const Surfaces& surfaces,
                         const HeldBodies& bodies, std::span<btSoftBody* const> listed) {
  std::vector<std::vector<btCollisionObject*>> groups = joints.pairs();
  for (const auto& coupling : couplings.all()) {
    if (!coupling->is_complete) continue;
    groups.emplace_back();
    for (const HeldPoint& point : coupling->points) groups.back().push_back(point.object());
  }
  for (btSoftBody* body : listed)
    if (has_anchors(*body) && bodies.find(*body))
      groups.push_back(held_together(*body, WorldObjects(body->getWorldInfo()->m_broadphase)));
  for (const auto& [a, b] : surfaces.neighbours()) {
    const HeldBody *one = bodies.find(a), *two = bodies.find(b);
    const bool has_one = one && bodies.is_listed(*one), has_two = two && bodies.is_listed(*two);
    if (has_one && has_two)
      groups.push_back({one->body, two->body});
    else if (has_one || has_two)  // the other is gone, which may have carried it
      (has_one ? one : two)->body->activate(true);
  }
  for (bool changed = true; changed;) {  // chains take several passes
    changed = false;
    for (const auto& group : groups) {
      const bool restless =
          std::any_of(group.begin(), group.end(), [](const auto* object) { return is_restless(*object); });
      const bool active = std::any_of(group.begin(), group.end(), [](const auto* object) {
        return object->isActive() && !object->isStaticOrKinematicObject();
      });
      if (!restless && !active) continue;
      for (btCollisionObject* object : group) {
        const int wanted = restless ? ACTIVE_TAG : WANTS_DEACTIVATION;
        if (!can_sleep(*object) || object->getActivationState() == wanted) continue;
        object->forceActivationState(wanted);
        changed = true;
      }
    }
  }
}

}  // namespace penalty
