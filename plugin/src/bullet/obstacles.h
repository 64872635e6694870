// What soft bodies may touch: Bullet's broadphase searched, its shapes asked where their surfaces are.
#pragma once
#include <vector>

#include "penalty/math/types.h"

class btCollisionObject;
class btSoftBody;

namespace penalty {

struct HeldBody;
class RigidBodies;
struct WorldIsland;

/// An axis-aligned box; empty until a point is added.
struct Box {
  Vector3 low = Vector3::Constant(std::numeric_limits<Real>::infinity());
  Vector3 high = -low;

  void add(const Vector3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  bool overlaps(const Box& other, Real padding) const {
    return ((low.array() - padding) <= other.high.array()).all() &&
           ((other.low.array() - padding) <= high.array()).all();
  }
  bool contains(const Vector3& p, Real padding) const {
    return ((low.array() - padding) <= p.array()).all() && ((high.array() + padding) >= p.array()).all();
  }
};

Box bounds_of(const btCollisionObject& object);

/// The objects whose boxes overlap that of the soft body, padded [m], and which it may touch, in the order in which
/// they came into the world.
std::vector<btCollisionObject*> obstacles_near(btSoftBody& body, const Box& box, Real padding);

/// Adds to the island of one body, which is about to be stepped, its contacts and what it may touch. Returns false
/// if the friction of an object is no number, and was left out.
bool detect_contacts(HeldBody& held, WorldIsland& island, const RigidBodies& rigid_bodies, Real duration);

}  // namespace penalty
