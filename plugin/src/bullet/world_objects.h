// All that is in a world: who is not among them may have been deleted.
#pragma once
#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include <vector>

#include "identity.h"
#include "penalty/contact/box.h"

class btRigidBody;

namespace penalty {

class WorldObjects final : public btBroadphaseAabbCallback {
 public:
  /// Of no world there is nothing.
  explicit WorldObjects(btBroadphaseInterface* world);

  /// Those in a box, as the broadphase knows them.
  WorldObjects(btBroadphaseInterface* world, const Box& box);

  bool process(const btBroadphaseProxy* proxy) override;

  bool contain(const btCollisionObject* object) const;

  /// Not if another stands at its address.
  bool contain(const Identity& name) const;

  /// Null if the object is not in the world, or another stands at its address.
  btRigidBody* rigid_body(const Identity& name) const;

 private:
  std::vector<btCollisionObject*> objects_;
};

}  // namespace penalty
