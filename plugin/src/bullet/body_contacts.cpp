#include "body_contacts.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "world_objects.h"

namespace penalty {

void BodyContacts::begin_step(Real duration) {
  duration_ = duration;
  std::swap(objects_, last_);
  objects_.clear();
  contacts_.clear();
  object_of_.clear();
}

void BodyContacts::clear() {
  begin_step(duration_);
  last_.clear();
}

std::size_t BodyContacts::number_of(const Identity& name) {
  const auto known = std::find(objects_.begin(), objects_.end(), name);
  const auto number = static_cast<std::size_t>(known - objects_.begin());
  if (known == objects_.end()) objects_.push_back(name);
  return number;
}

void BodyContacts::add(btCollisionObject& object, BodyContact contact) {
  const Identity name = Identity::of(object);
  contact.object = &object;
  contact.is_new = std::find(last_.begin(), last_.end(), name) == last_.end();
  object_of_.push_back(number_of(name));
  contacts_.push_back(contact);
}

void BodyContacts::forget(std::size_t object) {
  for (std::size_t k = 0; k < contacts_.size(); ++k)
    if (object_of_[k] == object) contacts_[k].object = nullptr;
}

// Most objects are where they touch; the others are looked for in the whole world.
std::span<const BodyContact> BodyContacts::of(const btSoftBody& body) {
  if (contacts_.empty()) return {};
  btBroadphaseInterface* const world = body.getBroadphaseHandle() ? body.m_worldInfo->m_broadphase : nullptr;
  Box box;
  for (const BodyContact& contact : contacts_) box.add(contact.point);
  const WorldObjects near(world, box);
  std::optional<WorldObjects> all;
  for (std::size_t k = 0; k < objects_.size(); ++k) {
    if (near.contain(objects_[k])) continue;
    if (!all) all.emplace(world);
    if (!all->contain(objects_[k])) forget(k);
  }
  return contacts_;
}

void BodyContacts::add_force_on(const Identity& object, const Vector3& center, ContactForce& sum) const {
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (objects_[object_of_[k]] != object) continue;
    const Vector3 force = -contacts_[k].impulse / duration_;
    sum.force += force;
    sum.torque += (contacts_[k].point - center).cross(force);
  }
}

}  // namespace penalty
