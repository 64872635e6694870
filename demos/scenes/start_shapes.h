// Hard starts: positions far from the rest shape.
#pragma once
#include "scenes/scene_options.h"

namespace penalty::demo {

/// `rest`, 3 x V [m], as a body of start `start` begins: about the middle of the bounding box, y up. Exact: what a
/// plane shall be lies in it to the last bit. `seed` decides what is random.
Eigen::Matrix3Xd start_positions(const Eigen::Matrix3Xd& rest, Start start, std::uint32_t seed);

}  // namespace penalty::demo
