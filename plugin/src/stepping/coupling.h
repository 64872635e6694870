// What the sub-cycle does with couplings.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// Energy and forces of the coupling where its points are now.
void evaluate_forces(Coupling& coupling, const Island& island);

/// The velocities of its points, into `coupling.velocities`.
void gather_velocities(Coupling& coupling, const Island& island);

/// Gives its impulses for `time` [s] to the bodies. Comes before the other forces of the same kick: the work of each
/// part is that at the mean of the velocities before and after the whole.
void kick(const Coupling& coupling, Island& island, Real time);

/// The velocities that `PotentialField::dissipate` makes of the points, as impulses on the bodies. The mobility that it
/// reckons with is no smaller than the true one, so that energy falls. Returns the work of who drives points that
/// nothing moves.
Real dissipate(Coupling& coupling, Island& island, Real duration);

}  // namespace penalty
