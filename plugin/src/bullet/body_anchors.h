// Bullet's anchors of an attached body: of appendAnchor and of appendDeformableAnchor, in both worlds.
#pragma once

#include <vector>

class btCollisionObject;
class btSoftBody;

namespace penalty {

struct HeldBody;
class RigidBodies;
class WorldObjects;
struct WeightedPoint;
struct WorldIsland;

bool has_anchors(const btSoftBody& body);

/// The body, and those of the objects that it is anchored to which may move.
std::vector<btCollisionObject*> held_together(btSoftBody& body, const WorldObjects& objects);

/// Reads them into `held.anchors`. Returns what is wrong, or null.
const char* read_anchors(HeldBody& held, const WorldObjects& objects);

bool is_anchored(const HeldBody& held, const btCollisionObject& object);

/// A particle of the point is held at the object: there is no contact between the two.
bool is_anchored(const HeldBody& held, const WeightedPoint& point, const btCollisionObject& object);

/// Adds the anchors to the island of the body.
void add_anchors(const HeldBody& held, const RigidBodies& rigid_bodies, WorldIsland& island);

}  // namespace penalty
