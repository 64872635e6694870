// What soft bodies may touch: Bullet's broadphase searched, its shapes asked where their surfaces are.
#pragma once
#include <vector>

#include "penalty/contact/box.h"

class btCollisionObject;
class btRigidBody;
class btSoftBody;

namespace penalty {

struct HeldBody;
class RigidBodies;
class RigidSurfaces;
struct WorldIsland;

/// How far a rigid body may come in a step [m].
Real reach_of(const btRigidBody& rigid, Real duration);

Box bounds_of(const btCollisionObject& object);

/// Whether the soft body may touch the object as far as Bullet's filters, flags and lists say.
bool may_collide(const btCollisionObject& object, const btSoftBody& body);

/// The objects whose boxes overlap that of the soft body, padded [m], and which it may touch, in the order in which
/// they came into the world.
std::vector<btCollisionObject*> obstacles_near(btSoftBody& body, const Box& box, Real padding);

/// Adds to the island of one body, which is about to be stepped, its contacts and what it may touch. Returns false
/// if the friction of an object is no number, and was left out.
bool detect_contacts(HeldBody& held, WorldIsland& island, const RigidBodies& rigid_bodies,
                     RigidSurfaces& rigid_surfaces, Real duration);

}  // namespace penalty
