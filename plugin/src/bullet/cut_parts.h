// What a cut through a body separates.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "penalty/fields/topology.h"

namespace penalty {

/// Of a body that is held together by `edges`, some of which are cut: the parts that hang together by uncut edges have
/// two colours, different ones at the two ends of a cut. Returns for each particle whether its colour has the lesser mass
/// where it hangs together with the other at all. What is cut from itself, as by a slit, is not separated; where three
/// parts meet, the heaviest decides.
std::vector<char> lesser_parts(std::span<const Real> inverse_masses, std::span<const Edge> edges,
                               const std::function<bool(const Edge&)>& is_cut);

}  // namespace penalty
