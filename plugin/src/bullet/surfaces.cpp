#include "surfaces.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "convert.h"
#include "held_bodies.h"
#include "obstacles.h"
#include "world_island.h"

namespace penalty {
namespace {

constexpr Real largest_way = 1e3;  // in a step [m]

/// Where a body is, and how far it may come in a step [m].
struct Extent {
  Box box;
  Real way = 0;

  /// What would cross the world in a step meets nobody: it would take all the others into its island, and down with it.
  bool is_sane() const {
    return std::isfinite(box.low.sum() + box.high.sum() + way) &&
           way <= std::max(largest_way, 100 * (box.high - box.low).norm());
  }
  Box swept() const {
    Box swept = box;
    swept.low.array() -= way;
    swept.high.array() += way;
    return swept;
  }
};

// At the velocities that it has, those that its elastic energy may give it, and those of rigid bodies that hit it.
Extent extent_of(const HeldBody& held, std::span<const TouchedRigidBody> touched, Real duration) {
  const SteppedBody& stepped = held.stepped;
  Real fastest2 = held.fastest2, pushed = 0;
  for (int i = 0; i < stepped.external_forces.cols(); ++i)
    pushed = std::max(pushed, stepped.particles.inverse_masses[i] * stepped.external_forces.col(i).norm());
  if (stepped.mass > 0) fastest2 += 2 * std::max<Real>(stepped.elastic_energy, 0) / stepped.mass;
  Real fastest = std::sqrt(fastest2);
  for (const TouchedRigidBody& t : touched) fastest = std::max(fastest, t.start.velocity.norm());
  return {.box = held.box,
          .way = fastest * duration + (stepped.gravity.norm() + pushed) * duration * duration + held.margin()};
}

// As the nodes say, which the application may have changed.
Extent extent_of_nodes(const HeldBody& held, Real duration) {
  const btSoftBody& body = *held.body;
  Extent extent;
  Real fastest2 = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    extent.box.add(to_vector(body.m_nodes[i].m_x));
    fastest2 = std::max(fastest2, Real(body.m_nodes[i].m_v.length2()));
  }
  const Real gravity = Real(body.m_worldInfo->m_gravity.length()) * std::abs(Real(body.m_gravityFactor));
  extent.way = std::sqrt(fastest2) * duration + gravity * duration * duration + held.margin();
  return extent;
}

bool touches_itself(HeldBody& held) {
  const std::optional<bool>& wish = held.options.self_contact;
  if (wish && !*wish) return false;
  const ContactSurface& surface = surface_of(held);
  return !surface.edges().empty() && (wish || !surface.is_closed());
}

bool may_touch(const HeldBody& a, const HeldBody& b) {
  return may_collide(*a.body, *b.body) && may_collide(*b.body, *a.body);
}

// Pairs of boxes that overlap, by number.
std::vector<std::array<int, 2>> overlaps(std::span<const Extent> extents) {
  std::vector<Box> boxes;
  boxes.reserve(extents.size());
  for (const Extent& extent : extents) boxes.push_back(extent.swept());
  std::vector<int> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    return boxes[i].low.x() != boxes[j].low.x() ? boxes[i].low.x() < boxes[j].low.x() : i < j;
  });
  std::vector<std::array<int, 2>> found;
  for (std::size_t k = 0; k < order.size(); ++k)
    for (std::size_t l = k + 1; l < order.size() && boxes[order[l]].low.x() <= boxes[order[k]].high.x(); ++l)
      if (boxes[order[k]].overlaps(boxes[order[l]], 0))
        found.push_back({std::min(order[k], order[l]), std::max(order[k], order[l])});
  std::sort(found.begin(), found.end());
  return found;
}

// The same, where each may be struck by those that it meets, and then comes as far as they do.
std::vector<std::array<int, 2>> overlaps_of_struck(std::span<Extent> extents) {
  std::vector<std::array<int, 2>> found = overlaps(extents);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [i, j] : found) {
      const Real way = std::max(extents[i].way, extents[j].way);
      changed = changed || extents[i].way < way || extents[j].way < way;
      extents[i].way = extents[j].way = way;
    }
    if (changed) found = overlaps(extents);
  }
  return found;
}

}  // namespace

void Surfaces::wake_touched(const HeldBodies& bodies, std::span<btSoftBody* const> listed, Real duration) {
  std::vector<HeldBody*> held;
  bool any_asleep = false;
  for (btSoftBody* body : listed)
    if (HeldBody* h = bodies.find(*body)) {
      held.push_back(h);
      any_asleep = any_asleep || !body->isActive();
    }
  if (!any_asleep) return;
  std::vector<Extent> extents;
  extents.reserve(held.size());
  for (const HeldBody* h : held) extents.push_back(extent_of_nodes(*h, duration));
  for (Extent& extent : extents)
    if (!extent.is_sane()) extent = {};
  const auto pairs = overlaps(extents);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [i, j] : pairs) {
      btSoftBody &a = *held[i]->body, &b = *held[j]->body;
      if (a.isActive() == b.isActive() || !may_touch(*held[i], *held[j])) continue;
      (a.isActive() ? b : a).activate(true);
      changed = changed || a.isActive() == b.isActive();  // not those that are disabled
    }
  }
}

SurfacePair& Surfaces::pair_of(HeldBody& first, HeldBody& second) {
  HeldBody& a = first.order < second.order ? first : second;
  HeldBody& b = &a == &first ? second : first;
  const std::array key{a.order, b.order};
  const std::array surfaces{a.surface, b.surface};
  auto entry = entries_.find(key);
  if (entry == entries_.end() || entry->second.surfaces != surfaces)
    entry = entries_
                .insert_or_assign(key, Entry{.bodies = {a.identity(), b.identity()},
                                             .surfaces = surfaces,
                                             .pair = std::make_unique<SurfacePair>(*a.surface, *b.surface)})
                .first;
  entry->second.is_used = true;
  return *entry->second.pair;
}

void Surfaces::join(std::vector<WorldIsland>& islands, const HeldBodies& bodies, Real duration) {
  for (auto& [key, entry] : entries_) entry.is_used = false;
  std::vector<HeldBody*> held;
  std::vector<int> island_of;
  std::vector<Extent> extents;
  for (std::size_t k = 0; k < islands.size(); ++k) {
    Real way = 0;  // what is coupled may come as far as the other
    const std::size_t first = held.size();
    for (HeldBody* body : islands[k].held) {
      const Extent extent = extent_of(*body, islands[k].touched, duration);
      if (!body->body->hasContactResponse() || !extent.is_sane()) continue;
      held.push_back(body);
      island_of.push_back(static_cast<int>(k));
      extents.push_back(extent);
      way = std::max(way, extent.way);
    }
    for (std::size_t i = first; i < extents.size(); ++i) extents[i].way = way;
  }
  std::vector<int> joined(islands.size());  // into which island
  std::iota(joined.begin(), joined.end(), 0);
  const auto root = [&](int island) {
    while (joined[island] != island) island = joined[island];
    return island;
  };
  const auto add = [&](HeldBody& a, HeldBody& b, int island) {
    SurfacePair& pair = pair_of(a, b);
    islands[island].surfaces.push_back({&pair, a.order < b.order ? &a : &b, a.order < b.order ? &b : &a});
  };
  for (std::size_t k = 0; k < held.size(); ++k)
    if (touches_itself(*held[k])) add(*held[k], *held[k], island_of[k]);
  for (const auto& [i, j] : overlaps_of_struck(extents)) {
    if (!may_touch(*held[i], *held[j])) continue;
    surface_of(*held[i]);
    surface_of(*held[j]);
    add(*held[i], *held[j], island_of[i]);
    const int one = root(island_of[i]), two = root(island_of[j]);
    joined[std::max(one, two)] = std::min(one, two);
  }
  for (std::size_t k = 0; k < islands.size(); ++k)
    if (const int into = root(static_cast<int>(k)); into != static_cast<int>(k)) islands[into].absorb(islands[k]);
  std::erase_if(islands, [](const WorldIsland& island) { return island.held.empty(); });
  // Who sleeps on another is to wake when that one goes.
  const auto sleeps = [&](const Identity& name) {
    const HeldBody* body = bodies.find(name);
    return body && bodies.is_listed(*body) && !body->body->isActive();
  };
  std::erase_if(entries_, [&](const auto& entry) {
    const auto& [a, b] = entry.second.bodies;
    return !entry.second.is_used && !(sleeps(a) && sleeps(b));
  });
}

std::vector<std::array<Identity, 2>> Surfaces::neighbours() const {
  std::vector<std::array<Identity, 2>> pairs;
  for (const auto& [key, entry] : entries_)
    if (!entry.pair->is_self()) pairs.push_back(entry.bodies);
  return pairs;
}

}  // namespace penalty
