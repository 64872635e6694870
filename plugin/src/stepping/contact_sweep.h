// Contacts as one-sided velocity constraints.
#pragma once
#include "penalty/stepping/island.h"

namespace penalty {

inline constexpr Real recovery_time = 0.05;  // in which depth is taken back [s],
inline constexpr Real recovery_speed = 0.5;  // no faster than this [m/s]

/// What a sweep did to energy [J], and how much it did.
struct ContactWork {
  Real outside = 0;  // by bodies that move but take no impulse, and of taking depth back
  Real loss = 0;     // to impact and friction
  Real change = 0;   // the largest of a normal speed [m/s]
};

/// One sweep over the contacts of body `body` of the island at positions that are about to drift for `duration` h [s].
/// Of the gap g and the relative normal speed u the sweep asks u >= -g/h while the gap is open and u >= 0 when it is
/// closed: it stops approach. Depth beyond the slop of the body is taken back: there it asks u >= depth / 0.05 s, at most
/// half a metre a second, and what that gives is work from outside. So is what driven particles give to a body that they
/// push; two that cannot move are left alone. The impulse goes to side a and, with the opposite sign, to side b: to a
/// rigid body at the point of a, so that both momenta are kept to round-off.
/// Friction is clipped to Coulomb's cone.
ContactWork solve_contacts(Island& island, std::size_t body, Real duration);

/// The contacts whose side a belongs to body number `body`.
inline std::span<Contact> contacts_of(Island& island, std::size_t body) {
  const std::size_t begin = island.contacts_begin[body];
  return {island.contacts.data() + begin, island.contacts_begin[body + 1] - begin};
}

/// Some contact has particles of this body on one of its sides. Surfaces are not asked.
bool is_in_contact(const Island& island, std::size_t body);

/// Puts the contacts in the order of the bodies of their sides a, and remembers where those of each begin.
void sort_contacts(Island& island);

}  // namespace penalty
