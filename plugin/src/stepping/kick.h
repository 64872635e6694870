// Velocities by forces, positions by velocities.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// v += time * (f / m + g), of which a pinned particle keeps its velocity.
void kick(SteppedBody& body, Real time);

/// x += time * v.
void drift(SteppedBody& body, Real time);

/// Both in one pass over the particles.
void kick_and_drift(SteppedBody& body, Real kick_time, Real drift_time);

}  // namespace penalty
