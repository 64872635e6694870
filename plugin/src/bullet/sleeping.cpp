#include "sleeping.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cmath>

#include "convert.h"
#include "couplings.h"
#include "obstacles.h"
#include "world_island.h"

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

void wake_if_hit(btSoftBody& body) {
  // After a step of a duration that is no number.
  if (!std::isfinite(body.getDeactivationTime())) body.setDeactivationTime(0);
  if (body.getActivationState() != ISLAND_SLEEPING) return;
  Box box;
  for (int i = 0; i < body.m_nodes.size(); ++i) box.add(to_vector(body.m_nodes[i].m_x));
  const Real margin = body.getCollisionShape()->getMargin();
  for (btCollisionObject* object : obstacles_near(body, box, margin)) {
    const btRigidBody* rigid = btRigidBody::upcast(object);
    if (!rigid || !rigid->isActive() || rigid->isStaticObject()) continue;
    if (Real(rigid->getLinearVelocity().length()) > waking_speed && bounds_of(*object).overlaps(box, 2 * margin))
      body.activate(true);
  }
}

void wait_for_carried(btSoftBody& body, const WorldIsland& island) {
  for (const TouchedRigidBody& touched : island.touched)
    if (touched.start.is_dynamic() && touched.body->getActivationState() != WANTS_DEACTIVATION)
      body.setDeactivationTime(0);
}

// Chains of couplings take several passes.
void keep_coupled_awake(const Couplings& couplings) {
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& coupling : couplings.all()) {
      if (!coupling->is_complete) continue;
      bool restless = false, active = false;
      for (const HeldPoint& point : coupling->points) {
        const btCollisionObject& object = *point.object();
        restless = restless || is_restless(object);
        active = active || (object.isActive() && !object.isStaticOrKinematicObject());
      }
      if (!restless && !active) continue;
      for (const HeldPoint& point : coupling->points) {
        btCollisionObject& object = *point.object();
        const int wanted = restless ? ACTIVE_TAG : WANTS_DEACTIVATION;
        if (!can_sleep(object) || object.getActivationState() == wanted) continue;
        object.forceActivationState(wanted);
        changed = true;
      }
    }
  }
}

}  // namespace penalty
