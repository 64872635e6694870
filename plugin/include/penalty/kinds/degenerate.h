// When a triangle is too thin to have a normal: shared by the kinds that need one.
#pragma once
#include <algorithm>
#include <cmath>

#include "penalty/kinds/kind.h"
#include "penalty/math/triple.h"

namespace penalty::detail {

/// Below this ratio round-off in the coordinates decides the direction of a normal.
inline constexpr Real smallest_sine = 1e-8;

/// Whether the legs u and v from one corner, with normal u x v, span next to nothing: |u x v| <= 1e-8 max(|u|, |v|)².
/// True also for numbers that are not finite.
inline bool is_thin(Triple u, Triple v, Triple normal) {
  const Real limit = smallest_sine * std::max(dot(u, u), dot(v, v));
  return !(dot(normal, normal) > limit * limit);
}

/// The area of the triangle with these legs [m²]. Throws std::invalid_argument "<kind>: <what> is <area>" where it is
/// zero, not finite or that of a thin triangle.
inline Real require_area(std::string_view kind, std::string_view what, Triple u, Triple v) {
  const Triple normal = cross(u, v);
  const Real area = std::sqrt(dot(normal, normal)) / 2;
  require_rest_value(kind, what, area);
  if (is_thin(u, v, normal))
    throw std::invalid_argument(std::string(kind) + ": " + std::string(what) + " is " + to_text(area) +
                                ", next to nothing for its edges");
  return area;
}

}  // namespace penalty::detail
