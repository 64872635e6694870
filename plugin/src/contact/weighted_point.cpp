#include "penalty/contact/weighted_point.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"

namespace penalty {

void WeightedPoint::check(int num_particles, const std::string& what) const {
  const auto fail = [&](const std::string& why) { throw std::invalid_argument(what + ": " + why); };
  if (size < 1 || size > 4) fail("has " + std::to_string(size) + " particles, must have 1 to 4");
  Real sum = 0;
  for (int k = 0; k < size; ++k) {
    if (particles[k] < 0 || particles[k] >= num_particles)
      fail("index " + std::to_string(particles[k]) + " is outside the " + std::to_string(num_particles) + " nodes");
    for (int l = 0; l < k; ++l)
      if (particles[k] == particles[l]) fail("index " + std::to_string(particles[k]) + " appears twice");
    sum += weights[k];
  }
  if (!(std::abs(sum - 1) < 1e-6)) fail("weights sum to " + to_text(sum) + ", must sum to 1");
}

}  // namespace penalty
