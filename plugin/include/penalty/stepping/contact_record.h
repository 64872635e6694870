// What a contact did in a step.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Places are those at the end of the step; impulses are sums over its substeps, and so is the normal their mean.
struct ContactRecord {
  int body = -1;                          // index into the bodies of the island
  int other_body = -1, other_rigid = -1;  // what that touches, of which one is -1: likewise, or into the rigid bodies
  Vector3 point = Vector3::Zero();        // [m]
  Vector3 normal = Vector3::Zero();       // from the other one to the body
  Vector3 impulse = Vector3::Zero();      // on the body [N s]
  Real gap = 0;                           // beyond the distance that is kept; negative: depth [m]
  bool slides = false;                    // friction was at its limit for most of the impulse
  bool still_presses = false;             // in the last substep, too
};

}  // namespace penalty
