#include "penalty/fields/batch.h"

namespace penalty {

// GCC compiles one function twice and the loader picks: fused multiply-add and three-operand instructions are worth a
// fifth of the time. Elsewhere there is only the plain one.
template <ElementKind Kind>
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
[[gnu::target_clones("arch=x86-64-v3", "default")]]
#endif
Real add_own_element_forces(const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils,
                            const Kind* kinds, const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  return add_element_forces(stencils, kinds, stiffnesses, size, x, f);
}

template class Batch<Length>;
template class Batch<TriangleArea>;
template class Batch<TetrahedronVolume>;
template class Batch<CornerAngle>;
template class Batch<TetrahedronDihedralAngle>;
template class Batch<BendingAngle>;
template class Batch<Distance>;
template class Batch<Attachment>;
template class Batch<EnclosedVolume>;
template class Batch<ShapeMatch>;
template class Batch<StableNeoHookean>;

}  // namespace penalty
