// The surfaces of an island: those of its soft bodies, and corners and edges of rigid ones.
#pragma once
#include <utility>

#include "penalty/contact/surface_pair.h"
#include "penalty/stepping/island.h"

namespace penalty {

/// All of them at once, each one time however many pairs it is in.
class IslandSurfaces {
 public:
  explicit IslandSurfaces(Island& island);

  /// Begins a step from where the bodies are.
  void begin_step();

  void take_positions();
  void take_velocities();
  void drift(Real duration);

  /// All that was known of distances is void.
  void forget();

  /// Calls visit(surface, body) for those of soft bodies and of rigid ones.
  template <class Visit>
  void visit_soft(const Visit& visit) const {
    for (const auto& [surface, body] : soft_) visit(*surface, *body);
  }
  template <class Visit>
  void visit_rigid(const Visit& visit) const {
    for (const auto& [surface, number] : rigid_) visit(*surface, island_.rigid_bodies[number]);
  }

 private:
  Island& island_;
  std::vector<std::pair<ContactSurface*, SteppedBody*>> soft_;
  std::vector<std::pair<ContactSurface*, int>> rigid_;
};

}  // namespace penalty
