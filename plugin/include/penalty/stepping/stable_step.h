// The largest substep that an explicit step can take.
#pragma once
#include <functional>
#include <span>

#include "penalty/fields/potential_field.h"

namespace penalty {

/// An upper bound of the largest eigenvalue of M^-1 K [1/s²], K the taut Gauss-Newton stiffness at `x` (exact where
/// every constraint is at rest, and of slack elements too: they may become taut): the substep h is stable below 2 /
/// sqrt(bound). Lanczos' method gives the largest Ritz value, and its residual norm, added, makes it a bound; the
/// Gershgorin row sums cap it. Deterministic. 0 for a field without elements or particles that are all pinned.
Real largest_eigenvalue_bound(const PotentialField& field, const Positions& x, std::span<const Real> inverse_masses);

/// The same of any symmetric positive semidefinite matrix K, by `add_product(x, y)`, y += K x, and a bound that is known.
Real largest_eigenvalue_bound(const std::function<void(const Vectors&, Forces)>& add_product, Real ceiling,
                              std::span<const Real> inverse_masses);

/// The first from the Gershgorin row sums alone, max_i bounds_i / m_i: one pass, 1.5 to 2 times too high in frequency.
Real gershgorin_bound(const PotentialField& field, const Positions& x, std::span<const Real> inverse_masses);

}  // namespace penalty
