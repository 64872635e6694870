// Contact of a soft body with a rigid one, as a one-sided velocity constraint.
#pragma once
#include <array>
#include <span>

#include "penalty/stepping/particles.h"
#include "penalty/stepping/rigid_body.h"

namespace penalty {

/// A point of a soft body: up to four particles and their weights, which sum to one.
struct ContactPoint {
  std::array<int, 4> particles{};
  std::array<Real, 4> weights{};
  int num_particles = 0;

  static ContactPoint at_particle(int particle) { return {{particle}, {1}, 1}; }
};

/// The point may not go below the plane through `anchor` with outward unit normal `normal`, both fixed in the rigid body; or,
/// with a positive `radius`, not closer to `anchor` than that: the surface of a ball.
struct Contact {
  ContactPoint point;
  int rigid_body = 0;                 // index into the rigid bodies of the island
  Vector3 anchor, normal;             // in the frame of the rigid body [m], [-]
  Real friction = 0;                  // Coulomb coefficient
  Real radius = 0;                    // of a ball about the anchor; zero: a plane [m]
  Real depth = 0;                     // largest depth below the plane during the step [m], reported
  Vector3 impulse = Vector3::Zero();  // on the point, of the last sweep [N s], reported
};

/// What a sweep did to energy [J].
struct ContactWork {
  Real obstacles = 0;  // by bodies that move but take no impulse
  Real particles = 0;  // on the particles
  Real loss = 0;       // to impact and friction
};

/// One sweep over the contacts at positions that are about to drift for `duration` h [s]. Of the gap g and the relative
/// normal speed u the sweep asks u >= -g/h while the gap is open and u >= 0 when it is closed: it stops approach, and
/// never pushes out by velocity. The impulse goes to the particles and, with the opposite sign, to the rigid body at the same
/// point, so both momenta are kept to round-off; friction is clipped to Coulomb's cone. Depth beyond `slop` [m] against
/// bodies that cannot move is taken back by position, one per cent a sweep.
ContactWork solve_contacts(std::span<Contact> contacts, Particles& particles, std::span<RigidBody> rigid_bodies,
                           Real duration, Real slop);

}  // namespace penalty
