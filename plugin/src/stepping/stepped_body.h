// What both integrators do with a body.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

inline Real inverse_or_zero(Real value) { return value > 0 ? 1 / value : 0; }

/// Energy and forces of the body where it is now.
void evaluate_forces(SteppedBody& body);

/// Forces alone: `elastic_energy` is then out of date.
void evaluate_forces_only(SteppedBody& body);

/// Half the work that an impulse on a particle shares with the kick of the body's own forces [J].
Real kick_work(const SteppedBody& body, int particle, const Vector3& impulse, Real kick_time);

/// Unfolds it if it may, chooses its phase, keeps the state to go back to, and books what changed since the last step.
/// Returns kinetic + elastic energy [J].
Real begin_step(SteppedBody& body, bool may_unfold = true);

/// Goes back to the state that `begin_step` kept.
void undo_step(SteppedBody& body);

/// Takes the drag of a step and closes its books.
void end_step(SteppedBody& body, Real duration);

/// Work of gravity and external forces since the start of the step [J].
Real constant_force_work(const SteppedBody& body);

/// Kinetic + elastic energy of an island [J].
Real energy(const Island& island);

/// Work of gravity, external forces and accelerations of an island since the start of the step [J].
Real constant_force_work(Island& island);

/// Names the particle to look at after a step that could not be made finite, in the state that it started from: one
/// that is not finite itself; if there is none in the island, the fastest of each body.
void name_bad_particles(std::span<SteppedBody* const> bodies);

}  // namespace penalty
