// How many dimensions a set of points spans.
#pragma once
#include <span>

#include "penalty/math/types.h"

namespace penalty {

/// The affine space that points span: 3 in general position, 2 in a plane, 1 on a line, 0 all in one place. A body that
/// has been pressed into fewer dimensions than it has at rest may stay there: every force lies in that space.
struct AffineSpan {
  int dimension = 0;
  Vector3 spreads =
      Vector3::Zero();  // root mean square distance from the mean along the principal axes, descending [m]
};

/// Counts the principal axes along which the points spread by more than 1e-6 of `scale` [m]; 0: of their largest
/// spread. Points that are not finite, or whose squares are not, count as in general position.
AffineSpan affine_span(const Positions& points, Real scale = 0);

/// Moves every particle but those of zero inverse mass by at most `distance` [m] along each axis, in a direction that
/// its number alone decides.
void jitter(PackedVectors& points, std::span<const Real> inverse_masses, Real distance);

/// If the points span fewer dimensions than `rest`, whose span is `rest_span`, adds a tenth of the rest shape to them,
/// turned as it fits best, and a jitter of a thousandth of the mean distance of its points: the way out of a plane, a
/// line or a point on which no two elements disagree which side is up. Returns whether it did. One column a point in
/// all arrays; points of zero inverse mass stay.
bool unfold(PackedVectors& points, const Positions& rest, const AffineSpan& rest_span,
            std::span<const Real> inverse_masses);

}  // namespace penalty
