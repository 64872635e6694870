#include "world_island.h"

#include <algorithm>

#include "couplings.h"
#include "held_bodies.h"

namespace penalty {

void WorldIsland::absorb(WorldIsland& from) {
  std::vector<int> renumbered;
  for (const TouchedRigidBody& other : from.touched) {
    const auto known =
        std::find_if(touched.begin(), touched.end(), [&](const TouchedRigidBody& t) { return t.key == other.key; });
    renumbered.push_back(static_cast<int>(known - touched.begin()));
    if (known == touched.end()) touched.push_back(other);
  }
  for (HeldBody* body : from.held) {
    for (Contact& contact : body->stepped.contacts) contact.rigid_body = renumbered[contact.rigid_body];
    held.push_back(body);
  }
  couplings.insert(couplings.end(), from.couplings.begin(), from.couplings.end());
  from = {};
}

bool WorldIsland::shares_a_rigid_body_with(const WorldIsland& other) const {
  for (const TouchedRigidBody& first : touched)
    for (const TouchedRigidBody& second : other.touched)
      if (first.key == second.key && first.start.is_dynamic()) return true;
  return false;
}

void WorldIsland::advance(Real duration, std::vector<RigidBody>& states) {
  std::vector<SteppedBody*> bodies;
  for (HeldBody* body : held) bodies.push_back(&body->stepped);
  states.clear();
  for (const TouchedRigidBody& t : touched) states.push_back(t.start);
  std::vector<Coupling*> stepped_couplings;
  for (HeldCoupling* coupling : couplings) {
    for (std::size_t k = 0; k < coupling->points.size(); ++k) {
      const HeldPoint& point = coupling->points[k];
      CoupledPoint& coupled = coupling->stepped.points[k];
      if (point.soft) {
        const auto body = std::find(held.begin(), held.end(), point.soft);
        coupled = {.body = static_cast<int>(body - held.begin()), .particle = point.point.node};
      } else {
        const auto body = std::find_if(touched.begin(), touched.end(),
                                       [&](const TouchedRigidBody& t) { return t.body == point.rigid; });
        coupled = {.rigid_body = static_cast<int>(body - touched.begin()), .anchor = point.point.anchor};
      }
    }
    const std::uint64_t version = coupling->field.stiffness_version();
    estimate_stability(coupling->stepped, bodies, states, coupling->field.rest_positions(),
                       version != coupling->estimated_version);
    coupling->estimated_version = version;
    stepped_couplings.push_back(&coupling->stepped);
  }
  penalty::advance(bodies, states, duration, stepped_couplings);
}

}  // namespace penalty
