// One step of one body by backward Euler.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

void advance_implicitly(SteppedBody& body, Real duration);

}  // namespace penalty
