// Four reals at once, a particle and what pads it: for loops over particles that the compiler is to see as such.
#pragma once
#include <cstring>

#include "penalty/math/types.h"

namespace penalty {

using Quadruple = Real __attribute__((vector_size(32)));

// Particles are aligned to half of what such a register would like. By reference, as functions for any processor have no
// way to return one.
[[gnu::always_inline]] inline void load_quadruple(const Real* p, Quadruple& q) { std::memcpy(&q, p, sizeof q); }
[[gnu::always_inline]] inline void store_quadruple(Real* p, const Quadruple& q) { std::memcpy(p, &q, sizeof q); }

}  // namespace penalty
