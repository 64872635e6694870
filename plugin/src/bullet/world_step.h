// One step of all soft bodies of a solver, inside Bullet's world step.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "couplings.h"
#include "held_bodies.h"
#include "impacts.h"
#include "rigid_bodies.h"
#include "rigid_joints.h"
#include "rigid_manifolds.h"
#include "rigid_surfaces.h"
#include "surfaces.h"
#include "world_island.h"

namespace penalty {

/// The attached bodies of one solver and their way through a world step. Nothing here throws through Bullet's frames: a
/// body that cannot be stepped is held where it is, and its report says why.
class AttachedBodies::World {
 public:
  std::shared_ptr<HeldBodies> bodies = std::make_shared<HeldBodies>();  // handles look at it, too
  Couplings couplings;
  RigidJoints joints;
  std::shared_ptr<const ContactCallback> contact_callback;  // null: none so far

  /// Steps the attached and active ones of `listed`, all soft bodies of the world, from what their nodes say, together
  /// with the rigid bodies that they touch, whose velocities change. `gravity_applied`: the world has already added
  /// gravity to the velocities of rigid bodies. Returns the bodies that were stepped; their nodes are still to be
  /// written.
  std::span<HeldBody* const> step(std::span<btSoftBody* const> listed, Real duration, bool gravity_applied) noexcept;

  /// Takes what Bullet's constraints made of the nodes after they were written.
  void read_solved(HeldBody& held) noexcept;

  /// Between these two Bullet finds those that are held without velocity.
  void freeze_held(std::span<btSoftBody* const> listed) const noexcept;
  void thaw_held(std::span<btSoftBody* const> listed) const noexcept;

  /// Moves touched rigid bodies to where the sub-cycle took them. Call after Bullet has integrated the transforms.
  void correct_rigid_bodies(Real duration) noexcept;

  /// Calls who wants to know of contacts. The last thing in a step: bodies may be deleted in it.
  void tell_contacts() noexcept;

 private:
  void hold_all(std::span<btSoftBody* const> listed, const char* problem, bool finite) noexcept;
  void step_all(std::span<btSoftBody* const> listed, Real duration);
  void prepare(HeldBody& held, Real duration);
  void join_islands(Real duration);
  void advance(WorldIsland& island, Real duration) noexcept;

  RigidBodies rigid_bodies_;
  RigidManifolds rigid_manifolds_;
  RigidSurfaces rigid_surfaces_;
  Surfaces surfaces_;
  Impacts impacts_;
  std::vector<WorldIsland> islands_;
  Island island_;  // the one that is being advanced; keeps its memory
  std::vector<HeldBody*> stepped_;
  std::vector<Identity> to_be_told_of_;
  btBroadphaseInterface* broadphase_ = nullptr;
};

/// The soft bodies of a world.
inline std::span<btSoftBody* const> listed(const btAlignedObjectArray<btSoftBody*>& bodies) {
  return {bodies.size() ? &bodies[0] : nullptr, static_cast<std::size_t>(bodies.size())};
}

/// Puts what was set back into the report.
void report_rejected(HeldBody& held) noexcept;

/// Whether Bullet's precision has numbers for the state of the body. If not, the body is held, at rest where it was.
bool stays_in_range(HeldBody& held) noexcept;

}  // namespace penalty
