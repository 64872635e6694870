// What is stepped together.
#pragma once
#include <span>
#include <vector>

#include "joint_rows.h"
#include "penalty/stepping/island.h"
#include "rigid_bodies.h"
#include "surfaces.h"

namespace penalty {

struct HeldBody;
struct HeldCoupling;

/// Body k of the island is held[k], rigid body k touched[k].
struct WorldIsland {
  std::vector<HeldBody*> held;
  std::vector<TouchedRigidBody> touched;
  std::vector<HeldCoupling*> couplings;
  std::vector<Contact> contacts;
  std::vector<Anchor> anchors;
  std::vector<HeldPair> surfaces;
  std::vector<RigidContact> rigid_contacts;
  std::vector<Impact> impacts;
  std::vector<HeldJoint> joints;                     // none after a step that was undone
  const btContactSolverInfo* solver_info = nullptr;  // of the world, if there are joints

  /// Takes in what `from` holds, which is empty afterwards.
  void absorb(WorldIsland& from);

  /// Whether both touch the same movable body.
  bool shares_a_rigid_body_with(const WorldIsland& other) const;

  /// Advances all of it [s]; afterwards `island.rigid_bodies` are the states of the touched bodies, and the held ones
  /// know their contacts.
  void advance(Real duration, Island& island);

 private:
  StepReport advance_with_joints(Real duration, Island& island);
  void hand_out(Real duration, std::span<const ContactRecord> records);
};

}  // namespace penalty
