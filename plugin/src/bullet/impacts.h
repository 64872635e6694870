// The hits of bodies that have restitution, from step to step.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <span>

#include "penalty/stepping/impact.h"

namespace penalty {

struct WorldIsland;

class Impacts {
 public:
  /// Adds to an island, before it is advanced, the pairs whose contacts have restitution, as Bullet combines it: its
  /// product, at most 1.
  void add(WorldIsland& island) const;

  /// After the step: hits go on.
  void remember(std::span<const WorldIsland> islands);

 private:
  std::map<std::array<std::uint64_t, 3>, Impact> last_;  // by orders of soft bodies, and the key of the rigid one
};

}  // namespace penalty
