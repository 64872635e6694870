// One step of an island as many explicit substeps.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

void advance_explicitly(Island& island, Real duration);

}  // namespace penalty
