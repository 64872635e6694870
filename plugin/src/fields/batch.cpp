#include "penalty/fields/batch.h"

#include "../math/processors.h"
#include "penalty/fields/batch_loops.h"
#include "row_kernels.h"

namespace penalty {
namespace detail {
namespace {

template <ElementKind Kind>
PENALTY_TARGET_CLONES Real add_forces_one_by_one(const StencilOf<Kind>* stencils, const Kind* kinds,
                                                 const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  return add_element_forces(stencils, kinds, stiffnesses, size, x, f);
}

template <ElementKind Kind>
PENALTY_TARGET_CLONES void add_forces_only_one_by_one(const StencilOf<Kind>* stencils, const Kind* kinds,
                                                      const Real* stiffnesses, std::size_t size, const Real* x,
                                                      Real* f) {
  add_element_forces_only(stencils, kinds, stiffnesses, size, x, f);
}

template <ElementKind Kind>
PENALTY_TARGET_CLONES void add_modes_one_by_one(const StencilOf<Kind>* stencils, const Kind* kinds,
                                                const Real* stiffnesses, const Real* times, std::size_t size,
                                                const Real* x, Real time, Real duration, DampingModes& modes) {
  add_element_modes(stencils, kinds, stiffnesses, times, size, x, time, duration, modes);
}

}  // namespace

// Never inlined, so that they are here for batches that a program compiles itself.
template <ElementKind Kind>
[[gnu::noinline]] Real add_own_element_forces(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  if constexpr (has_rows<Kind>)
    if (rows::are_supported()) {
      const Real energy = rows::add_forces(stencils, kinds, stiffnesses, size, x, f);
      if constexpr (HasEnergyGradient<Kind>)
        return rows::energy(stencils, kinds, stiffnesses, size, x);
      else
        return energy;
    }
  return add_forces_one_by_one(stencils, kinds, stiffnesses, size, x, f);
}

template <ElementKind Kind>
[[gnu::noinline]] void add_own_element_forces_only(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, std::size_t size, const Real* x, Real* f) {
  if constexpr (has_rows<Kind>)
    if (rows::are_supported()) {
      rows::add_forces(stencils, kinds, stiffnesses, size, x, f);
      return;
    }
  if constexpr (HasEnergyGradient<Kind>)
    add_forces_only_one_by_one(stencils, kinds, stiffnesses, size, x, f);
  else
    add_forces_one_by_one(stencils, kinds, stiffnesses, size, x, f);
}

template <ElementKind Kind>
[[gnu::noinline]] void add_own_element_modes(
    const std::array<int, static_cast<std::size_t>(Kind::num_points)>* stencils, const Kind* kinds,
    const Real* stiffnesses, const Real* times, std::size_t size, const Real* x, Real time, Real duration,
    DampingModes& modes) {
  add_modes_one_by_one(stencils, kinds, stiffnesses, times, size, x, time, duration, modes);
}

}  // namespace detail

namespace {

template <class Kind>
std::unique_ptr<ElementBatch> make(int num_particles, std::string name) {
  return std::make_unique<Batch<Kind>>(num_particles, std::move(name));
}

// The addresses of the makers escape in this table: that is what makes the compiler emit every batch of the list here,
// once.
template <class... Kinds>
constexpr auto table_of(KindList<Kinds...>) {
  return std::array{KindEntry{Kinds::name, Kinds::num_points, &make<Kinds>}...};
}
constexpr auto table = table_of(OwnKinds{});

}  // namespace

std::unique_ptr<ElementBatch> detail::make_own_batch(std::size_t kind, int num_particles, std::string name) {
  return table[kind].make(num_particles, std::move(name));
}

std::span<const KindEntry> own_kinds() { return table; }

}  // namespace penalty
