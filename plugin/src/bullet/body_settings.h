// What Bullet's settings of a soft body do to one that is attached.
#pragma once
#include <string>
#include <vector>

#include "penalty/math/types.h"

class btSoftBody;

namespace penalty {

/// A setting that Bullet's own part of the step would spread over the nodes, and on into its trees, for good. Null: all
/// are finite.
const char* not_finite_setting(const btSoftBody& body);

/// Adds Bullet's aerodynamics (kDG, kLF, the wind), pressure (kPR) and volume (kVC) of a step of `duration` [s] to the
/// forces on the nodes, as btSoftBody::predictMotion does.
void add_forces_of_settings(btSoftBody& body, Real duration);

/// Areas, link constants and rest lengths, if Bullet asks for them anew.
void update_constants(btSoftBody& body);

/// Settings that ask for something, and get nothing, while the body is attached, or less, as a margin of more than
/// `largest_margin` [m]: a line each, with what to use instead.
std::vector<std::string> unused_settings(const btSoftBody& body, Real largest_margin);

}  // namespace penalty
