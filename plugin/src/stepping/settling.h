// What lies comes to rest.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// Damps for `duration` [s] what something that is at rest for good holds, be it through other bodies, by what its contacts
/// gave so far in the step, which are the records of the island: see StepOptions::settling_speed. Bodies that cling to each
/// other are one. Of how that moves as a rigid body, what its contacts leave free stays as it is: it slides, turns and rolls
/// on. Bodies with pinned particles, and rigid ones with joints or anchors, take no part. Returns whether anything was damped.
bool settle(Island& island, Real duration);

}  // namespace penalty
