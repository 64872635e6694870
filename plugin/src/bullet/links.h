// Links of Bullet's multibodies: bodies that their joints hold.
#pragma once
#include <array>
#include <span>
#include <unordered_map>
#include <vector>

#include "penalty/stepping/rigid_body.h"

class btCollisionObject;
class btMultiBody;
class btMultiBodyLinkCollider;

namespace penalty {

struct TouchedRigidBody;

/// Velocity [m/s] and angular velocity [rad/s] of a link of a multibody; zero of other objects.
std::array<Vector3, 2> link_velocities(const btCollisionObject& object);

/// Whether soft bodies can push the object: a link of a multibody that is awake and not held where it is.
bool is_movable_link(const btCollisionObject& object);

bool are_of_one_multibody(const btCollisionObject& a, const btCollisionObject& b);

/// What a step sees of multibodies, and gives back to them.
class Links {
 public:
  void begin_step(int step);

  /// Wakes the multibody if the object is one of its links. It takes impulses from the next step on, when Bullet has made
  /// its accelerations again.
  static void wake(btCollisionObject& object);

  /// Velocities and accelerations of a link into what `touched` starts with, for a step of `duration` [s].
  void read(TouchedRigidBody& touched, Real duration) const;

  /// Brings the links of each multibody among the touched together. Call when these have their places in the island.
  static void couple(std::span<TouchedRigidBody> touched);

  /// Gives multibodies what their links were given.
  void hand_back(std::span<const TouchedRigidBody> touched);

  /// To be called when the world has integrated: what joints and motors did in this step they will do again.
  void observe(const TouchedRigidBody& touched);

 private:
  struct Memory {  // velocities and changes of a multibody, of its base and its joints
    int step = 0;
    Eigen::VectorXd given, handed_back, end;
  };
  std::unordered_map<const btMultiBody*, Memory> memories_;
  int step_ = 0;
};

}  // namespace penalty
