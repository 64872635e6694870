// The surfaces of attached bodies, and which of them may touch: Bullet's filters asked, soft body against soft body.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "identity.h"
#include "penalty/contact/surface_pair.h"

class btSoftBody;

namespace penalty {

class HeldBodies;
struct HeldBody;
struct WorldIsland;

/// The surface of the body with its margin and friction of now, made anew when the application has added faces or links.
ContactSurface& surface_of(HeldBody& held);

/// A pair of an island.
struct HeldPair {
  SurfacePair* pair;
  HeldBody* a;
  HeldBody* b;       // the same: the body with itself; null: corners and edges of
  int touched = -1;  // a rigid body, by its number in the island
};

/// Pairs of surfaces are kept from step to step while the boxes that the bodies may sweep overlap.
class Surfaces {
 public:
  /// Wakes the attached bodies of the world that sleep where one that is awake may come in `duration` [s].
  static void wake_touched(const HeldBodies& bodies, std::span<btSoftBody* const> listed, Real duration);

  /// Adds pairs to the islands, and makes one island of those whose bodies may touch within `duration` [s].
  void join(std::vector<WorldIsland>& islands, const HeldBodies& bodies, Real duration);

  /// Bodies that might have touched in the last step, or when both fell asleep.
  std::vector<std::array<Identity, 2>> neighbours() const;

 private:
  struct Entry {
    std::array<Identity, 2> bodies;
    std::array<std::shared_ptr<ContactSurface>, 2> surfaces;  // of these it was made
    std::unique_ptr<SurfacePair> pair;
    bool is_used = false;
  };

  SurfacePair& pair_of(HeldBody& a, HeldBody& b);

  std::map<std::array<std::uint64_t, 2>, Entry> entries_;  // by the order in which the bodies were attached
};

}  // namespace penalty
