// One step by backward Euler of soft bodies and what they touch.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

class ImplicitSurfaces;

/// Of an island of soft bodies and of rigid ones. Returns false, with all where it was, if surfaces cannot be kept apart so, or
/// energy would grow.
bool advance_implicitly(Island& island, ImplicitSurfaces& surfaces, Real duration);

}  // namespace penalty
