#include "penalty/assembly/batch.h"

namespace penalty {
namespace {

// GCC compiles one function twice and the loader picks: fused multiply-add and three-operand instructions are worth a
// fifth of the time. Elsewhere there is only the plain one.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
[[gnu::target_clones("arch=x86-64-v3", "default")]]
#endif
Real add_length_forces(const std::array<int, 2>* stencils, const Length* kinds, const Real* stiffnesses,
                       std::size_t size, const Real* x, Real* f) {
  return add_penalty_forces(stencils, kinds, stiffnesses, size, x, f);
}

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
[[gnu::target_clones("arch=x86-64-v3", "default")]]
#endif
Real add_volume_forces(const std::array<int, 4>* stencils, const TetrahedronVolume* kinds, const Real* stiffnesses,
                       std::size_t size, const Real* x, Real* f) {
  return add_penalty_forces(stencils, kinds, stiffnesses, size, x, f);
}

}  // namespace

template <>
Real Batch<Length>::add_forces(const Positions& x, Forces f) const {
  return add_length_forces(stencils_.data(), kinds_.data(), stiffnesses_.data(), stencils_.size(), x.data(), f.data());
}

template <>
Real Batch<TetrahedronVolume>::add_forces(const Positions& x, Forces f) const {
  return add_volume_forces(stencils_.data(), kinds_.data(), stiffnesses_.data(), stencils_.size(), x.data(), f.data());
}

template class Batch<Length>;
template class Batch<TetrahedronVolume>;

}  // namespace penalty
