// One step of one body by backward Euler.
#pragma once
#include "penalty/stepping/step.h"

namespace penalty {

void advance_implicitly(SteppedBody& body, Real duration);

}  // namespace penalty
