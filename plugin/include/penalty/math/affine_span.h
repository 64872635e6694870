// How many dimensions a set of points spans.
#pragma once
#include <span>

#include "penalty/math/types.h"

namespace penalty {

/// The affine space that points span: 3 in general position, 2 in a plane, 1 on a line, 0 all in one place. A body that has
/// been pressed into fewer dimensions than it has at rest may stay there: every force lies in that space.
struct AffineSpan {
  int dimension = 0;
  Vector3 spreads = Vector3::Zero();  // root mean square distance from the mean along the principal axes, descending [m]
};

/// Counts the principal axes along which the points spread by more than 1e-6 of `scale` [m]; 0: of their largest spread.
/// Points that are not finite, or whose squares are not, count as in general position.
AffineSpan affine_span(const Positions& points, Real scale = 0);

/// How far particles are moved out of a space of fewer dimensions than at rest: a quarter of their mean distance there [m].
Real unfolding_distance(const AffineSpan& rest, Eigen::Index num_points);

/// Moves every particle but those of zero inverse mass by at most `distance` [m] along each axis, in a direction that its
/// number alone decides.
void jitter(PackedVectors& points, std::span<const Real> inverse_masses, Real distance);

}  // namespace penalty
