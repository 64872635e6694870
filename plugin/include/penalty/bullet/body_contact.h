// Where a soft body touches something, and what that gives.
#pragma once
#include <functional>
#include <span>

#include "penalty/math/types.h"

class btCollisionObject;
class btSoftBody;

namespace penalty {

/// One contact of an attached body in the last world step: a node or another point of it at an object, or a corner or
/// edge at its triangles. Places are those at the end of the step; impulses are sums over the whole of it, and so is the
/// normal their mean.
struct BodyContact {
  const btCollisionObject* object = nullptr;  // that it touches, maybe itself; null: it has left the world since
  Vector3 point = Vector3::Zero();            // [m]
  Vector3 normal = Vector3::Zero();           // unit, off the object, towards the body
  Vector3 impulse = Vector3::Zero();          // on the body [N s]
  Real gap = 0;                               // beyond the margins that are kept; negative: depth [m]
  bool slides = false;                        // friction is at its limit, or there is none; else it holds
  bool is_new = false;                        // in its step before, the body did not touch this object

  Real normal_impulse() const { return normal.dot(impulse); }                       // [N s]
  Vector3 friction_impulse() const { return impulse - normal_impulse() * normal; }  // on the body [N s]
};

/// What soft bodies do to an object.
struct ContactForce {
  Vector3 force = Vector3::Zero();   // [N]
  Vector3 torque = Vector3::Zero();  // about the centre of mass, where it is now [N m]
};

/// Is told the contacts of a body, see AttachedBodies::set_contact_callback.
using ContactCallback = std::function<void(const btSoftBody& body, std::span<const BodyContact> contacts)>;

}  // namespace penalty
