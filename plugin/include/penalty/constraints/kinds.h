// The list of kinds. A new kind is its header and one line here: the property tests run over it.
#pragma once
#include "penalty/constraints/length.h"
#include "penalty/constraints/tetrahedron_volume.h"

namespace penalty {

template <class... Kinds>
struct KindList {};

using AllKinds = KindList<Length, TetrahedronVolume>;

}  // namespace penalty
