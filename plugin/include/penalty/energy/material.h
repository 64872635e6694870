// Physical numbers into penalty stiffnesses.
#pragma once
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"

namespace penalty {

/// An isotropic elastic material, made of springs along the edges and volume penalties of a tetrahedral mesh.
///
/// Averaged over directions, springs with K = Y v_e (v_e the rest volume that the edge stands for) have Lamé parameters
/// mu = lambda = Y/15, and volumes with K = kappa V_t add kappa to lambda. Hence K_length = 15 mu v_e and
/// K_volume = (lambda - mu) V_t: both scale with the volume of the element, so that refining the mesh keeps the stiffness
/// of the body. The springs alone already have Poisson ratio 1/4, the least that this pair can express.
struct Material {
  Real young = 1e5;     // E [Pa]
  Real poisson = 0.35;  // nu, in [0.25, 0.5)
  Real density = 1000;  // [kg/m³]

  Real lame_mu() const { return young / (2 * (1 + poisson)); }
  Real lame_lambda() const { return young * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
  Real length_stiffness_density() const { return 15 * lame_mu(); }               // K_length / v_e [J/m³]
  Real volume_stiffness_density() const { return lame_lambda() - lame_mu(); }    // K_volume / V_t [J/m³]

  /// Throws std::invalid_argument that names the number out of range.
  void check() const {
    const auto require = [](bool ok, const char* name, Real value, const char* range) {
      if (!ok)
        throw std::invalid_argument(std::string("material: ") + name + " is " + to_text(value) + ", must be " + range);
    };
    require(young > 0 && young < 1e300, "Young's modulus", young, "positive and finite [Pa]");
    require(poisson >= 0.25 && poisson < 0.5, "Poisson's ratio", poisson, "in [0.25, 0.5) for springs and volumes");
    require(density > 0 && density < 1e300, "density", density, "positive and finite [kg/m³]");
  }
};

}  // namespace penalty
