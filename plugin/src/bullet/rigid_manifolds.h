// What touches the rigid bodies of an island from behind: other rigid bodies, the ground.
#pragma once
#include <array>
#include <map>
#include <span>
#include <vector>

#include "penalty/contact/contact.h"

class btCollisionDispatcher;
class btTypedConstraint;
struct btBroadphasePair;
struct btSoftBodyWorldInfo;

namespace penalty {

class RigidBodies;
class RigidJoints;
struct TouchedRigidBody;
struct WorldIsland;

class RigidManifolds {
 public:
  /// Adds to the islands Bullet's contacts of their movable rigid bodies, as found where these are now, or where
  /// corners may come in `duration` [s], their joints, and the bodies that are reached so, from one to the next. Islands
  /// that meet become one. In the impulses that Bullet remembers of these contacts there is nothing afterwards: its own
  /// solver, to which they are left satisfied, would give them again.
  void add(std::vector<WorldIsland>& islands, const btSoftBodyWorldInfo& info, const RigidBodies& rigid_bodies,
           RigidJoints& joints, Real duration);

  /// After the step: contacts that are found again begin with the forces that they have.
  void remember(const std::vector<WorldIsland>& islands);

 private:
  struct Reach;

  void add_contacts(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, int key, Reach& reach) const;
  static void add_joint(btTypedConstraint& joint, const RigidJoints& joints, int key, Reach& reach);
  void recall(std::span<const TouchedRigidBody> touched, Real size, std::vector<RigidContact>& contacts) const;

  std::map<std::array<int, 2>, std::vector<RigidContact>> last_;  // of the last step, by the keys of their bodies
};

}  // namespace penalty
