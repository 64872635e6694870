// What comes back of a hit beyond what elastic bodies give back by themselves.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

inline constexpr Real restitution_threshold = 0.2;  // approach that is an impact [m/s]: Bullet's

/// Follows the hits of the island through the step that was just made, at its end, and gives back what their restitution
/// says. A hit begins where two bodies touch that did not in the step before, and came at each other faster than the
/// threshold: what lies, sways or slides hits nothing. From then on damping and contacts take their share of the soft
/// bodies' energy for the hit, by the impulses of all that touches them. When the bodies have left each other, or lie, an
/// impulse along the mean normal of the hit, in the middle of its contacts, gives back e² of that, and makes them no
/// faster than sqrt(r² + e² (a² - r²)) if they arrived at a and leave at r. A hit that lasts for longer than a body needs
/// for twice its size gives nothing.
///
/// The impulse moves a soft body as a rigid one. Given to the particles that touch, which are light, it would become
/// vibration: there restitution takes more of the rebound than it gives. So both momenta are kept to round-off, what is
/// between the particles stays as it is, and bodies have no more energy than they came with. A soft body that is held
/// somewhere takes no impulse.
void give_back(Island& island, Real duration);

}  // namespace penalty
