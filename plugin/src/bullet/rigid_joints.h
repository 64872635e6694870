// Joints of a world between rigid bodies that soft ones touch.
#pragma once
#include <BulletDynamics/Dynamics/btActionInterface.h>

#include <map>
#include <vector>

#include "joint_rows.h"

class btCollisionObject;
class btDiscreteDynamicsWorld;

namespace penalty {

struct WorldIsland;

/// Joints that islands take are switched off while Bullet's own solver runs, which would give their impulses again, and on
/// again before the application looks: in the classic world by an action, after the bodies have been moved.
class RigidJoints final : private btActionInterface {
 public:
  /// From now on the joints are those of this world, which outlives its next step.
  void take_from(btDiscreteDynamicsWorld& world);

  /// Lists the joints that are on, by the bodies that they hold.
  void list();

  /// Of the body with this key.
  const std::vector<btTypedConstraint*>& of(int key) const;

  /// Of the world, if it has joints.
  const btContactSolverInfo& solver_info() const;

  /// The joint between these bodies of an island, with what it gave in the last step.
  Joint joint_of(const btTypedConstraint& constraint, int a, int b) const;

  /// Keeps what the joints of the islands gave in a step of `duration` [s]. Those that asked for nothing are left to
  /// Bullet, which has an older way of its own for some.
  void remember(const std::vector<WorldIsland>& islands, Real duration);

  /// Switches these off, if the application has not done so since.
  void hide();

  /// Switches them on again, but for what broke, and says what they gave.
  void show();

  /// Pairs of bodies that joints held together in the last step, and still do.
  std::vector<std::vector<btCollisionObject*>> pairs() const;

 private:
  void updateAction(btCollisionWorld* world, btScalar duration) override;
  void debugDraw(btIDebugDraw* drawer) override;
  bool is_in_world(const btTypedConstraint* constraint) const;

  btDiscreteDynamicsWorld* world_ = nullptr;
  std::map<int, std::vector<btTypedConstraint*>> joints_;
  std::vector<HeldJoint> solved_, hidden_;
  std::map<const btTypedConstraint*, Joint> last_;  // of the last step, by addresses that are never followed
  Real duration_ = 0;
};

}  // namespace penalty
