// Which object of Bullet's this is, also when its memory has been given to another.
#pragma once
#include <cstdint>

class btCollisionObject;

namespace penalty {

/// Zero: none yet.
using SerialNumber = std::uintptr_t;

/// The serial number that the object carries in its extension pointer. That pointer is Bullet's own slot for
/// extensions: constructors set it to null, so memory left by another object says nothing; Bullet neither reads,
/// copies, draws nor writes it to files; it dies with the object; and what applications are given, user pointer and
/// indices, tags, materials and notes, stays theirs. If another extension has put something there, that is what the
/// object is known by.
SerialNumber serial_of(const btCollisionObject& object);

/// Gives the object a serial number if it has none.
SerialNumber give_serial(btCollisionObject& object);

/// An object as it was noted once. The address is compared, never followed: it may be that of freed memory.
struct Identity {
  const btCollisionObject* address = nullptr;
  SerialNumber serial = 0;

  static Identity of(btCollisionObject& object) { return {&object, give_serial(object)}; }
  bool is(const btCollisionObject& object) const { return address == &object && serial == serial_of(object); }
  bool operator==(const Identity&) const = default;
};

}  // namespace penalty
