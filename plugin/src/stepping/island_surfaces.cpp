#include "island_surfaces.h"

#include <algorithm>

namespace penalty {
namespace {

template <class Surfaces, class Body>
void add_once(Surfaces& surfaces, ContactSurface& surface, Body body) {
  if (const std::pair known(&surface, body); std::ranges::find(surfaces, known) == surfaces.end())
    surfaces.push_back(known);
}

}  // namespace

IslandSurfaces::IslandSurfaces(Island& island) : island_(island) {
  for (const SurfaceContact& contact : island.surfaces) {
    add_once(soft_, contact.pair->a(), island.bodies[contact.body_a]);
    if (contact.rigid < 0)
      add_once(soft_, contact.pair->b(), island.bodies[contact.body_b]);
    else
      add_once(rigid_, contact.pair->b(), contact.rigid);
  }
}

void IslandSurfaces::begin_step() {
  visit_soft([](ContactSurface& surface, const SteppedBody& body) { surface.begin_step(body.particles.positions); });
  visit_rigid([](ContactSurface& surface, const RigidBody& body) { surface.begin_step(body.position, body.rotation); });
}

void IslandSurfaces::take_positions() {
  visit_soft(
      [](ContactSurface& surface, const SteppedBody& body) { surface.take_positions(body.particles.positions); });
  visit_rigid(
      [](ContactSurface& surface, const RigidBody& body) { surface.take_positions(body.position, body.rotation); });
}

void IslandSurfaces::take_velocities() {
  visit_soft(
      [](ContactSurface& surface, const SteppedBody& body) { surface.take_velocities(body.particles.velocities); });
  visit_rigid([](ContactSurface& surface, const RigidBody& body) {
    surface.take_velocities(body.velocity, body.angular_velocity);
  });
}

void IslandSurfaces::drift(Real duration) {
  for (const auto& [surface, body] : soft_) surface->drift(duration);
  for (const auto& [surface, number] : rigid_) surface->drift(duration);
}

void IslandSurfaces::forget() {
  for (const auto& [surface, body] : soft_) surface->forget();
  for (const auto& [surface, number] : rigid_) surface->forget();
}

}  // namespace penalty
