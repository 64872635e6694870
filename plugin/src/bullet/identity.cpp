#include "identity.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <atomic>

namespace penalty {
namespace {

SerialNumber next_serial() {
  static std::atomic<SerialNumber> last{0};
  return ++last;
}

}  // namespace

SerialNumber serial_of(const btCollisionObject& object) {
  return reinterpret_cast<SerialNumber>(object.internalGetExtensionPointer());
}

SerialNumber give_serial(btCollisionObject& object) {
  if (serial_of(object) == 0)
    object.internalSetExtensionPointer(reinterpret_cast<void*>(next_serial()));  // NOLINT(performance-no-int-to-ptr)
  return serial_of(object);
}

}  // namespace penalty
