// Bullet's anchors of an attached body: of appendAnchor and of appendDeformableAnchor, in both worlds.
#pragma once

class btCollisionObject;
class btSoftBody;

namespace penalty {

struct HeldBody;
class RigidBodies;
class WorldObjects;
struct WeightedPoint;
struct WorldIsland;

bool has_anchors(const btSoftBody& body);

/// Reads them into `held.anchors`. Returns what is wrong, or null.
const char* read_anchors(HeldBody& held, const WorldObjects& objects);

bool is_anchored(const HeldBody& held, const btCollisionObject& object);

/// A particle of the point is held at the object: there is no contact between the two.
bool is_anchored(const HeldBody& held, const WeightedPoint& point, const btCollisionObject& object);

/// Adds the anchors to the island of the body, and wakes what they hold.
void add_anchors(const HeldBody& held, const RigidBodies& rigid_bodies, WorldIsland& island);

}  // namespace penalty
