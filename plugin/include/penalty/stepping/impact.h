// Where two bodies may hit each other, and what a hit has taken of their motion.
#pragma once
#include "penalty/math/types.h"

namespace penalty {

/// Most of the speed of an elastic body that hits something comes back by itself; damping and impacts of its particles
/// take the rest. Restitution e gives back e² of the energy that they took, as Newton's law does where all was lost: with
/// r the share of the speed that comes back by itself, and nothing left in vibrations, the whole is sqrt(r² + e² (1 - r²)).
struct Impact {
  int body = -1;  // index into the bodies of the island
  int other_body = -1,
      other_rigid = -1;  // what that may hit, of which one is -1: likewise, larger, or into the rigid ones
  Real restitution = 0;  // e, in [0, 1]

  // Kept between steps.
  bool touched = false;              // in the last step
  Real arrival = 0;                  // speed of approach when the present hit began; 0: there is none [m/s]
  Real way = 0;                      // that it would have gone since [m]
  Real pressing_since = 0;           // sizes of impulses along the normals since [N s]
  Real lost = 0;                     // since then [J]
  Vector3 normal = Vector3::Zero();  // mean of the last step that touched, to `body`,
  Vector3 arm = Vector3::Zero();     // and the middle of the impulses, from the centre of mass of `body` [m]

  // What the step works in: sums over the contacts of the pair.
  Real pressing = 0;                  // sizes of impulses along the normals [N s],
  Vector3 pressed = Vector3::Zero();  // these impulses, on `body` [N s],
  Vector3 at = Vector3::Zero();       // and where, by size [N s m]; then their middle [m]
  bool still_presses = false;         // when the step ends
};

}  // namespace penalty
