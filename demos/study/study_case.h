// One run of a study, by the names of what it is made of.
#pragma once
#include <cstdint>
#include <string>

#include "penalty/math/types.h"

namespace penalty::study {

/// A body is recovered once its rest error, a share of the diagonal of the rest bounding box, is below this.
inline constexpr Real recovered_below = 1e-2;

struct StudyCase {
  std::string suite;
  std::string method;     // "static": relaxation; "classic", "deformable": in that world of Bullet
  std::string precision;  // of Bullet; "double" of a relaxation, which has no Bullet
  std::string material, mesh, start;
  std::uint32_t seed = 1;
  Real duration = 0;  // simulated [s]; 0 of a relaxation

  bool is_static() const { return method == "static"; }

  /// The way the body is moved, as tables name it: "static", or "classic float32 5 s".
  std::string run() const;

  /// Tells it from every other case: "world/classic float32 5 s/recovering/box4/scramble/3".
  std::string id() const;

  bool operator==(const StudyCase&) const = default;
};

}  // namespace penalty::study
