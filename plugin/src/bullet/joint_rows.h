// What Bullet's joints ask in the substeps.
#pragma once
#include <LinearMath/btTransform.h>

#include <span>
#include <vector>

#include "penalty/stepping/joint.h"

struct btContactSolverInfo;
class btRigidBody;
class btTypedConstraint;

namespace penalty {

struct TouchedRigidBody;

/// A joint of an island, by the numbers of its bodies there; -1: the world.
struct HeldJoint {
  btTypedConstraint* constraint;
  int a, b;
  Joint joint = {};  // before the step, and after it
};

/// How many rows the joint has where its bodies are; negative: more than can be taken.
int count_rows(btTypedConstraint& constraint);

/// Bullet's joints say what they ask of the bodies that they know, so these are lent the places and velocities of the
/// substep. They get their own back at the end.
class JointRows final : public JointSource {
 public:
  /// Of a world step of `duration` [s].
  JointRows(std::span<const HeldJoint> joints, std::span<const TouchedRigidBody> touched,
            const btContactSolverInfo& info, Real duration);
  ~JointRows() override;
  JointRows(const JointRows&) = delete;
  JointRows& operator=(const JointRows&) = delete;

  void add_rows(std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows) override;

 private:
  struct Lent {
    btRigidBody* body;
    int number;
    btTransform transform;
    btVector3 velocity, angular_velocity;
  };

  void add_rows_of(int joint, std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows);

  std::span<const HeldJoint> joints_;
  const btContactSolverInfo& info_;
  Real duration_;
  std::vector<Lent> lent_;
};

}  // namespace penalty
