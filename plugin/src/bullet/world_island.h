// What is stepped together.
#pragma once
#include <vector>

#include "penalty/stepping/step.h"
#include "rigid_bodies.h"

namespace penalty {

struct HeldBody;
struct HeldCoupling;

struct WorldIsland {
  std::vector<HeldBody*> held;
  std::vector<TouchedRigidBody> touched;
  std::vector<HeldCoupling*> couplings;

  /// Takes in what `from` holds, which is empty afterwards.
  void absorb(WorldIsland& from);

  /// Whether both touch the same movable body.
  bool shares_a_rigid_body_with(const WorldIsland& other) const;

  /// Advances all of it [s]; afterwards `states` are those of the touched bodies.
  void advance(Real duration, std::vector<RigidBody>& states);
};

}  // namespace penalty
