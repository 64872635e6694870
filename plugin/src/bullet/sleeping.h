// Who wakes whom, and who may fall asleep. Bullet decides; it does not know of soft contacts and couplings.
#pragma once
#include <algorithm>
#include <cmath>
#include <span>

#include "penalty/math/types.h"

class btSoftBody;

namespace penalty {

class Couplings;
class RigidJoints;
class HeldBodies;
class Surfaces;
struct HeldBody;
struct WorldIsland;

/// Slower than this [m/s], touching a soft body of this size [m] wakes neither it nor what it touches.
inline Real waking_speed(Real size) { return 0.1 * std::sqrt(std::min<Real>(size, 1)); }

/// An active soft body at rest for long enough is ready to sleep, as Bullet's deformable world has it; its classic world
/// leaves soft bodies, and all that touches them, awake for ever. `duration`: of the step that it has made [s].
void update_activation(HeldBody& held, Real duration);

/// A sleeping soft body wakes when something that moves comes near.
void wake_if_hit(btSoftBody& body);

/// A soft body sleeps only after what it carries, which in turn waits, as one island of Bullet's, for the soft body. What
/// is anchored to it, it sleeps with: see below.
void wait_for_carried(const HeldBody& held, const WorldIsland& island);

/// Bodies that are coupled or anchored, or might have touched, sleep together or not at all: while one is restless, those
/// that want to sleep stay awake, and keep the time that they have been at rest, so that all fall asleep when the last of
/// them may. `listed`: all soft bodies of the world.
void keep_awake_together(const Couplings& couplings, const RigidJoints& joints, const Surfaces& surfaces,
                         const HeldBodies& bodies, std::span<btSoftBody* const> listed);

}  // namespace penalty
