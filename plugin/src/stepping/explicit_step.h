// One step of an island as many explicit substeps.
#pragma once
#include "penalty/stepping/step.h"

namespace penalty {

void advance_explicitly(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration,
                        std::span<Coupling* const> couplings);

/// Substeps that the stability limit asks for, at least 1.
int wanted_substeps(std::span<SteppedBody* const> bodies, std::span<Coupling* const> couplings, Real duration);

}  // namespace penalty
