// Couplings of the attached bodies: made and taken away, kept awake together, brought into the step.
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "attached_world.h"
#include "penalty/math/text.h"

namespace penalty {

void AttachedBodies::World::wake(const AttachedCoupling& coupling) {
  for (const CouplingPoint& point : coupling.points) {
    if (point.soft_body) get(*point.soft_body).body->activate(true);
    if (point.rigid_body) point.rigid_body->activate();
  }
}

bool AttachedCoupling::holds(const btSoftBody& body) const {
  return std::any_of(points.begin(), points.end(),
                     [&](const CouplingPoint& point) { return point.soft_body == &body; });
}

int AttachedBodies::World::couple(std::vector<CouplingPoint> points, PotentialField field, Real damping_time) {
  if (static_cast<int>(points.size()) != field.num_particles())
    throw std::invalid_argument("couple: the field has " + std::to_string(field.num_particles()) + " particles for " +
                                std::to_string(points.size()) + " points");
  if (!(damping_time >= 0) || !std::isfinite(damping_time))
    throw std::invalid_argument("couple: damping_time is " + to_text(damping_time) + ", must be zero or positive [s]");
  bool any_soft = false;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto fail = [&](const std::string& what) {
      throw std::invalid_argument("couple: point " + std::to_string(k) + ": " + what);
    };
    const CouplingPoint& point = points[k];
    if (!point.soft_body == !point.rigid_body) fail("must be of one body, soft or rigid");
    if (point.soft_body) {
      any_soft = true;
      const AttachedBody* attached = find(*point.soft_body);
      if (!attached) fail("its soft body is not attached");
      if (point.node < 0 || point.node >= attached->stepped.particles.size())
        fail("node " + std::to_string(point.node) + " is outside the " +
             std::to_string(attached->stepped.particles.size()) + " of its body");
    } else {
      if (!point.rigid_body->getBroadphaseHandle()) fail("its rigid body is in no world");
      if (!point.anchor.allFinite()) fail("its anchor is not finite");
    }
    for (std::size_t l = 0; l < k; ++l)
      if (point.soft_body && points[l].soft_body == point.soft_body && points[l].node == point.node)
        fail("node " + std::to_string(point.node) + " is point " + std::to_string(l) + " already");
  }
  if (!any_soft)
    throw std::invalid_argument("couple: none of the " + std::to_string(points.size()) + " points is of a soft body");
  auto coupling =
      std::make_unique<AttachedCoupling>(AttachedCoupling{next_coupling_++, std::move(points), std::move(field), {}});
  coupling->stepped.potential = &coupling->field;
  coupling->stepped.damping_time = damping_time;
  coupling->stepped.points.resize(coupling->points.size());
  wake(*coupling);
  couplings_.push_back(std::move(coupling));
  return couplings_.back()->number;
}

AttachedCoupling& AttachedBodies::World::coupling(int number) {
  for (const auto& coupling : couplings_)
    if (coupling->number == number) return *coupling;
  throw std::invalid_argument("there is no coupling " + std::to_string(number));
}

void AttachedBodies::World::uncouple(int number) {
  const AttachedCoupling& gone = coupling(number);
  wake(gone);
  std::erase_if(couplings_, [&](const auto& coupling) { return coupling.get() == &gone; });
}

// Coupled bodies sleep together or not at all: while one is restless, those that want to sleep stay awake, and keep the time
// that they have been at rest, so that all fall asleep when the last of them may. Chains of couplings take several passes.
void AttachedBodies::World::wake_coupled() {
  const auto object_of = [this](const CouplingPoint& point) -> btCollisionObject& {
    if (point.soft_body) return *get(*point.soft_body).body;
    if (!point.rigid_body->getBroadphaseHandle())
      throw std::logic_error("a coupled rigid body has left the world: uncouple it first");
    return *point.rigid_body;
  };
  const auto can_sleep = [](const btCollisionObject& object) {
    return !object.isStaticOrKinematicObject() &&
           (object.getActivationState() == WANTS_DEACTIVATION || object.getActivationState() == ISLAND_SLEEPING);
  };
  const auto is_restless = [&](const btCollisionObject& object) {
    const btRigidBody* body = btRigidBody::upcast(&object);
    if (body && body->isStaticOrKinematicObject())
      return body->isKinematicObject() && !(body->getLinearVelocity().isZero() && body->getAngularVelocity().isZero());
    return object.isActive() && !can_sleep(object);
  };
  bool changed = true;
  while (changed) {
    changed = false;
    for (const auto& coupling : couplings_) {
      bool restless = false, active = false;
      for (const CouplingPoint& point : coupling->points) {
        const btCollisionObject& object = object_of(point);
        restless = restless || is_restless(object);
        active = active || (object.isActive() && !object.isStaticOrKinematicObject());
      }
      if (!restless && !active) continue;
      for (const CouplingPoint& point : coupling->points) {
        btCollisionObject& object = object_of(point);
        const int wanted = restless ? ACTIVE_TAG : WANTS_DEACTIVATION;
        if (!can_sleep(object) || object.getActivationState() == wanted) continue;
        object.forceActivationState(wanted);
        changed = true;
      }
    }
  }
}

// Brings the bodies of each coupling that is awake into one island. A coupling to a soft body that the application has
// switched off rests.
void AttachedBodies::World::join_coupled(Real duration, bool gravity_applied) {
  const auto island_of = [this](const SteppedBody& body) {
    return std::find_if(islands_.begin(), islands_.end(), [&](const Island& island) {
      return std::find(island.bodies.begin(), island.bodies.end(), &body) != island.bodies.end();
    });
  };
  for (const auto& coupling : couplings_) {
    const auto home = std::find_if(coupling->points.begin(), coupling->points.end(),
                                   [](const CouplingPoint& point) { return point.soft_body; });
    const auto island = island_of(get(*home->soft_body).stepped);
    if (island == islands_.end()) continue;
    const bool complete = std::all_of(
        coupling->points.begin(), coupling->points.end(),
        [&](const CouplingPoint& point) { return !point.soft_body || get(*point.soft_body).body->isActive(); });
    if (!complete) continue;
    for (const CouplingPoint& point : coupling->points) {
      if (point.rigid_body) {
        touch(*point.rigid_body, false, *island, duration, gravity_applied);
        continue;
      }
      const auto other = island_of(get(*point.soft_body).stepped);
      if (other == islands_.end())
        throw std::logic_error("a coupled soft body is not in the world of the others: uncouple it first");
      if (other != island) absorb(*island, *other);
    }
    island->couplings.push_back(coupling.get());
  }
}

}  // namespace penalty
