// What a body touched in its last step.
#pragma once
#include <span>
#include <vector>

#include "identity.h"
#include "penalty/bullet/body_contact.h"

class btBroadphaseInterface;
class btCollisionObject;
class btSoftBody;

namespace penalty {

class BodyContacts {
 public:
  /// Begins the list of a step of `duration` [s].
  void begin_step(Real duration);

  /// Says itself whether the object is new.
  void add(btCollisionObject& object, BodyContact contact);

  /// No step was made: nothing is touched.
  void clear();

  /// Whether the body touches something, or did in the step before.
  bool are_news() const { return !contacts_.empty() || !last_.empty(); }

  /// The contacts of the body, which is alive. Objects that are not in its world, as the broadphase knows it, become null.
  std::span<const BodyContact> of(const btSoftBody& body);

  /// Adds what the body did to the object; the torque is about `center`.
  void add_force_on(const Identity& object, const Vector3& center, ContactForce& sum) const;

 private:
  std::size_t number_of(const Identity& name);
  void forget(std::size_t object);

  std::vector<BodyContact> contacts_;
  std::vector<std::size_t> object_of_;    // each, by number
  std::vector<Identity> objects_, last_;  // of this step, and of the one before
  Real duration_ = 0;
};

}  // namespace penalty
