#include "world_objects.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>

#include "convert.h"

namespace penalty {

WorldObjects::WorldObjects(btBroadphaseInterface* world) {
  if (!world) return;
  const btVector3 corner(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  world->aabbTest(-corner, corner, *this);
  std::sort(objects_.begin(), objects_.end());
}

WorldObjects::WorldObjects(btBroadphaseInterface* world, const Box& box) {
  if (!world) return;
  world->aabbTest(to_bullet(box.low), to_bullet(box.high), *this);
  std::sort(objects_.begin(), objects_.end());
}

bool WorldObjects::process(const btBroadphaseProxy* proxy) {
  objects_.push_back(static_cast<btCollisionObject*>(proxy->m_clientObject));
  return true;
}

bool WorldObjects::contain(const btCollisionObject* object) const {
  return std::binary_search(objects_.begin(), objects_.end(), object);
}

bool WorldObjects::contain(const Identity& name) const { return contain(name.address) && name.is(*name.address); }

btRigidBody* WorldObjects::rigid_body(const Identity& name) const {
  const auto found = std::lower_bound(objects_.begin(), objects_.end(), name.address);
  return found != objects_.end() && name.is(**found) ? btRigidBody::upcast(*found) : nullptr;
}

}  // namespace penalty
