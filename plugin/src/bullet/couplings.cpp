#include "couplings.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "held_bodies.h"
#include "penalty/math/text.h"
#include "world_island.h"
#include "world_objects.h"

namespace penalty {
namespace {

void check_points(const HeldBodies& bodies, const std::vector<CouplingPoint>& points) {
  bool any_soft = false;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto fail = [&](const std::string& what) {
      throw std::invalid_argument("couple: point " + std::to_string(k) + ": " + what);
    };
    const CouplingPoint& point = points[k];
    if (!point.soft_body == !point.rigid_body) fail("must be of one body, soft or rigid");
    if (point.soft_body) {
      any_soft = true;
      const HeldBody* held = bodies.find(*point.soft_body);
      if (!held) fail("its soft body is not attached");
      point.point.check(held->stepped.particles.size(), "couple: point " + std::to_string(k));
    } else {
      if (!point.rigid_body->getBroadphaseHandle()) fail("its rigid body is in no world");
      if (!point.anchor.allFinite()) fail("its anchor is not finite");
    }
    for (std::size_t l = 0; l < k; ++l)
      if (point.soft_body && points[l].soft_body == point.soft_body && points[l].point == point.point)
        fail("is the same as point " + std::to_string(l));
  }
  if (!any_soft)
    throw std::invalid_argument("couple: none of the " + std::to_string(points.size()) + " points is of a soft body");
}

[[noreturn]] void refuse(int number) { throw std::invalid_argument("there is no coupling " + std::to_string(number)); }

void activate(const HeldPoint& point) {
  if (point.soft) point.soft->body->activate(true);
  if (point.rigid) point.rigid->activate();
}

}  // namespace

btCollisionObject* HeldPoint::object() const { return soft ? static_cast<btCollisionObject*>(soft->body) : rigid; }

bool HeldCoupling::holds(const Identity& name) const {
  return std::any_of(points.begin(), points.end(), [&](const HeldPoint& point) { return point.name == name; });
}

int Couplings::add(const HeldBodies& bodies, const std::vector<CouplingPoint>& points, PotentialField field,
                   Real damping_time) {
  if (static_cast<int>(points.size()) != field.num_particles())
    throw std::invalid_argument("couple: the field has " + std::to_string(field.num_particles()) + " particles for " +
                                std::to_string(points.size()) + " points");
  if (!(damping_time >= 0) || !std::isfinite(damping_time))
    throw std::invalid_argument("couple: damping_time is " + to_text(damping_time) + ", must be zero or positive [s]");
  check_points(bodies, points);
  std::vector<HeldPoint> held_points;
  for (const CouplingPoint& point : points) {
    HeldBody* const soft = point.soft_body ? bodies.find(*point.soft_body) : nullptr;
    held_points.push_back({point, soft ? soft->identity() : Identity::of(*point.rigid_body), soft, point.rigid_body});
  }
  auto coupling = std::make_unique<HeldCoupling>(
      HeldCoupling{.number = next_number_, .points = std::move(held_points), .field = std::move(field)});
  coupling->stepped.field = &coupling->field;
  coupling->stepped.damping_time = damping_time;
  coupling->stepped.points.resize(points.size());
  couplings_.push_back(std::move(coupling));
  for (const HeldPoint& point : couplings_.back()->points) activate(point);
  return next_number_++;
}

HeldCoupling& Couplings::get(int number) const {
  for (const auto& coupling : couplings_)
    if (coupling->number == number) return *coupling;
  refuse(number);
}

void Couplings::remove(int number) {
  if (number < 0 || number >= next_number_) refuse(number);
  std::erase_if(couplings_, [&](const auto& coupling) {
    if (coupling->number != number) return false;
    wake(*coupling);
    return true;
  });
}

void Couplings::remove_all_of(const btSoftBody& body) {
  const Identity name{&body, serial_of(body)};
  for (const auto& coupling : couplings_)
    if (coupling->holds(name)) wake(*coupling);
  std::erase_if(couplings_, [&](const auto& coupling) { return coupling->holds(name); });
}

void Couplings::wake(const HeldCoupling& coupling) {
  for (const HeldPoint& point : coupling.points)
    if (std::find(waking_.begin(), waking_.end(), point.name) == waking_.end()) waking_.push_back(point.name);
}

void Couplings::find_bodies(const HeldBodies& bodies, std::span<btSoftBody* const> listed) {
  if (couplings_.empty() && waking_.empty()) return;
  const auto known = std::find_if(listed.begin(), listed.end(), [&](btSoftBody* body) { return bodies.find(*body); });
  const WorldObjects objects(known == listed.end() ? nullptr : (*known)->getWorldInfo()->m_broadphase);
  const auto find = [&](HeldPoint& point) {
    HeldBody* const held = bodies.find(point.name);
    point.soft = held && bodies.is_listed(*held) ? held : nullptr;
    point.rigid = point.point.soft_body ? nullptr : objects.rigid_body(point.name);
  };
  for (const auto& coupling : couplings_) {
    const bool was_complete = coupling->is_complete;
    for (HeldPoint& point : coupling->points) find(point);
    coupling->is_complete = std::all_of(coupling->points.begin(), coupling->points.end(),
                                        [](const HeldPoint& point) { return point.object(); });
    if (was_complete && !coupling->is_complete) wake(*coupling);
  }
  std::erase_if(couplings_, [&](const auto& coupling) {
    return std::any_of(coupling->points.begin(), coupling->points.end(),
                       [&](const HeldPoint& point) { return point.point.soft_body && !bodies.find(point.name); });
  });
  for (const Identity& name : waking_) {
    HeldPoint point{.point = {}, .name = name};
    find(point);
    activate(point);
  }
  waking_.clear();
}

void Couplings::hold_bodies_of_incomplete() {
  for (const auto& coupling : couplings_) {
    const bool misses_rigid_body =
        std::any_of(coupling->points.begin(), coupling->points.end(),
                    [](const HeldPoint& point) { return !point.point.soft_body && !point.rigid; });
    if (!misses_rigid_body) continue;
    for (const HeldPoint& point : coupling->points)
      if (point.soft && point.soft->body->isActive())
        point.soft->hold("a rigid body that it is coupled to has left the world: uncouple it, or put it back", true);
  }
}

void Couplings::hold_coupled() {
  const auto is_held = [](const HeldPoint& point) { return point.soft && point.soft->outcome == StepOutcome::held; };
  const auto is_free = [&](const HeldPoint& point) {
    return point.soft && !is_held(point) && point.soft->body->isActive();
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& coupling : couplings_) {
      if (std::none_of(coupling->points.begin(), coupling->points.end(), is_held)) continue;
      for (const HeldPoint& point : coupling->points)
        if (is_free(point)) {
          point.soft->hold("a body that it is coupled to cannot be stepped", true);
          changed = true;
        }
    }
  }
}

void Couplings::join(std::vector<WorldIsland>& islands, const RigidBodies& rigid_bodies) const {
  const auto island_of = [&](const HeldBody* body) {
    return std::find_if(islands.begin(), islands.end(), [&](const WorldIsland& island) {
      return std::find(island.held.begin(), island.held.end(), body) != island.held.end();
    });
  };
  for (const auto& coupling : couplings_) {
    if (!coupling->is_complete) continue;
    const bool awake = std::all_of(coupling->points.begin(), coupling->points.end(), [&](const HeldPoint& point) {
      return !point.soft || island_of(point.soft) != islands.end();
    });
    if (!awake) continue;
    const auto home = std::find_if(coupling->points.begin(), coupling->points.end(),
                                   [](const HeldPoint& point) { return point.soft; });
    const auto island = island_of(home->soft);
    for (const HeldPoint& point : coupling->points) {
      if (point.rigid) {
        rigid_bodies.touch(*point.rigid, false, island->touched);
      } else if (const auto other = island_of(point.soft); other != island) {
        island->absorb(*other);
      }
    }
    island->couplings.push_back(coupling.get());
  }
}

}  // namespace penalty
