// Four reals at once, a particle and what pads it: for loops over particles that the compiler is to see as such.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

using Quadruple = Real __attribute__((vector_size(32), aligned(8), may_alias));

[[gnu::always_inline]] inline const Quadruple& quadruple(const Real* p) {
  return *reinterpret_cast<const Quadruple*>(p);
}
[[gnu::always_inline]] inline Quadruple& quadruple(Real* p) { return *reinterpret_cast<Quadruple*>(p); }

}  // namespace penalty
