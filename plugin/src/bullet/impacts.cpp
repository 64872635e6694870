#include "impacts.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>

#include "held_bodies.h"
#include "world_island.h"

namespace penalty {
namespace {

using ImpactPair = std::array<int, 3>;  // body, other body, other rigid body

ImpactPair impact_pair(const Impact& impact) { return {impact.body, impact.other_body, impact.other_rigid}; }

Real restitution_of(const WorldIsland& island, const ImpactPair& pair) {
  const auto& [body, soft, rigid] = pair;
  const btCollisionObject* other = soft < 0 ? island.touched[rigid].object : island.held[soft]->body;
  const Real e = btManifoldResult::calculateCombinedRestitution(island.held[body]->body, other);
  if (std::isfinite(e)) return std::clamp<Real>(e, 0, 1);
  island.held[body]->left_out = "the restitution of an object that it touches is not finite, and was left out";
  return 0;
}

std::array<std::uint64_t, 3> impact_key(const WorldIsland& island, const Impact& impact) {
  constexpr std::uint64_t soft = 0, rigid = 1;
  const std::uint64_t order = island.held[impact.body]->order;
  if (impact.other_body >= 0) return {order, soft, island.held[impact.other_body]->order};
  return {order, rigid, static_cast<std::uint64_t>(island.touched[impact.other_rigid].key)};
}

}  // namespace

void Impacts::add(WorldIsland& island) const {
  std::vector<Impact>& impacts = island.impacts;
  ImpactPair last{-1, -1, -1};
  const auto add_pair = [&](int body, int soft, int rigid) {
    if (soft >= 0 && soft < body) std::swap(body, soft);
    const ImpactPair pair{body, soft, rigid};
    if (pair == last || body == soft) return;
    last = pair;
    if (const Real e = restitution_of(island, pair); e > 0)
      impacts.push_back({.body = body, .other_body = soft, .other_rigid = rigid, .restitution = e});
  };
  for (std::size_t k = 0; k < island.held.size(); ++k) island.held[k]->number = static_cast<int>(k);
  for (const Contact& contact : island.contacts) add_pair(contact.a.body, contact.b.body, contact.b.rigid);
  for (const HeldPair& surface : island.surfaces)
    add_pair(surface.a->number, surface.b ? surface.b->number : -1, surface.touched);
  std::ranges::sort(impacts, {}, impact_pair);
  const auto are_one = [](const Impact& a, const Impact& b) { return impact_pair(a) == impact_pair(b); };
  impacts.erase(std::unique(impacts.begin(), impacts.end(), are_one), impacts.end());
  for (Impact& impact : impacts)
    if (const auto known = last_.find(impact_key(island, impact)); known != last_.end()) {
      const Impact now = impact;
      impact = known->second;
      impact.body = now.body;
      impact.other_body = now.other_body;
      impact.other_rigid = now.other_rigid;
      impact.restitution = now.restitution;
    }
}

void Impacts::remember(std::span<const WorldIsland> islands) {
  last_.clear();
  for (const WorldIsland& island : islands)
    for (const Impact& impact : island.impacts)
      if (impact.touched) last_.emplace(impact_key(island, impact), impact);
}

}  // namespace penalty
