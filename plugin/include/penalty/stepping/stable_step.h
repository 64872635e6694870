// The largest substep that an explicit step can take.
#pragma once
#include <functional>
#include <span>

#include "penalty/fields/potential_field.h"

namespace penalty {

/// The taut Gauss-Newton stiffness at `x`: exact where every constraint is at rest, and of slack elements too, which may
/// become taut.
System taut_stiffness(const PotentialField& field, const Positions& x);

/// An upper bound of the largest eigenvalue of M^-1 K [1/s²]: with the taut stiffness K, the substep h is stable below
/// 2 / sqrt(bound). Lanczos' method gives the largest Ritz value, and its residual norm, added, makes it a bound; the
/// Gershgorin row sums cap it. Deterministic. 0 for no stiffness or particles that are all pinned.
Real largest_eigenvalue_bound(const System& stiffness, std::span<const Real> inverse_masses);

/// The same of any symmetric positive semidefinite matrix K, by `add_product(x, y)`, y += K x, and a bound that is known.
Real largest_eigenvalue_bound(const std::function<void(const Vectors&, Forces)>& add_product, Real ceiling,
                              std::span<const Real> inverse_masses);

/// The first from the Gershgorin row sums alone, see `System::add_bounds`: without iterating, and higher.
Real gershgorin_bound(const System& stiffness, std::span<const Real> inverse_masses);

}  // namespace penalty
