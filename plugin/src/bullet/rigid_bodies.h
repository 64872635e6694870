// Rigid bodies, read before the step and corrected after it.
#pragma once
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "links.h"
#include "penalty/contact/box.h"
#include "penalty/stepping/rigid_body.h"

class btBroadphaseInterface;
class btCollisionObject;
class btRigidBody;

namespace penalty {

/// Whether the body is static. Bullet's manual leaves that flag on bodies that it makes kinematic.
bool stands_still(const btRigidBody& body);

struct Pose {
  Vector3 origin = Vector3::Zero();        // [m]
  Matrix3 rotation = Matrix3::Identity();  // object to world
};

/// Where the object is at the start of a step of `duration` [s]. A kinematic body is where the application wants it at the
/// end of the step, and comes there with its velocities.
Pose pose_at_start(const btCollisionObject& object, Real duration);

/// An object that takes part in a step.
struct TouchedRigidBody {
  btCollisionObject* object;
  btRigidBody* body;  // the same; null: an obstacle that is no rigid body, or a link of a multibody
  int key;            // unique id of its broadphase proxy
  Box bounds;         // at the start
  RigidBody start, state;
  std::shared_ptr<Articulation> articulation;  // of a link that can move
};

/// One step's dealings with Bullet's rigid bodies, and what is expected of them in the next.
class RigidBodies {
 public:
  /// `gravity_applied`: the world has already added gravity to the velocities of rigid bodies.
  void begin_step(Real duration, bool gravity_applied);

  /// The index of the object among those of an island, taking it in if it is new and waking it if a soft body comes at
  /// it.
  int touch(btCollisionObject& object, bool approached, std::vector<TouchedRigidBody>& touched) const;

  /// What pushed the body in the last step is among the contacts of the island, and is not expected again. Nor are joints:
  /// they would answer to what these contacts do, and each to the other's answer.
  void expect_no_others(TouchedRigidBody& touched) const;

  /// Adds to the velocities what soft bodies did to them.
  void hand_back(std::span<TouchedRigidBody> touched, std::span<const RigidBody> states);

  /// Moves touched bodies from where Bullet's integration with the end velocity put them to where the sub-cycle took
  /// them. Call after Bullet has integrated the transforms. Those that the world no longer has are left alone: callbacks
  /// of the application may have deleted them.
  void correct(std::span<const TouchedRigidBody> touched, btBroadphaseInterface& world, Real duration);

 private:
  // What was expected of a rigid body after the last step: the difference is what other contacts did to it.
  struct Expectation {
    int step;
    Vector3 velocity, impulse;
  };

  RigidBody start_of(const btCollisionObject& object) const;

  std::unordered_map<int, Expectation> expectations_;
  Links links_;
  int step_ = 0;
  Real duration_ = 0;
  bool gravity_applied_ = false;
};

}  // namespace penalty
