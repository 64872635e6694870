// One step by backward Euler of one body and what it touches.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

/// Of an island that consists of one body and of contacts of its points with what takes no impulse.
void advance_implicitly(Island& island, Real duration);

}  // namespace penalty
