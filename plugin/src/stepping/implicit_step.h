// One step by backward Euler of a soft body and what it touches.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

class ImplicitSurfaces;

/// Of an island of one soft body and of rigid ones. `surfaces`: those that may touch in this step; null: none.
void advance_implicitly(Island& island, ImplicitSurfaces* surfaces, Real duration);

}  // namespace penalty
