// Physical numbers into penalty stiffnesses.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

#include "penalty/math/text.h"

namespace penalty {

/// What a tetrahedral body is made of.
enum class ElasticModel {
  springs_volumes,        // Length and TetrahedronVolume: the seed's own form; Poisson's ratio 1/4 or more
  springs_areas_volumes,  // TriangleArea as well; Poisson's ratio 0.3 or more
  neo_hookean,            // StableNeoHookean: exact moduli on any mesh; Poisson's ratio 0 or more
};

/// An isotropic elastic material.
///
/// Averaged over directions, springs with K = Y v_e (v_e the rest volume that the edge stands for) have the Lamé
/// parameters mu = lambda = Y/15, areas with K = Y v_f have mu = Y/15 and lambda = 6Y/15, and volumes with K = kappa
/// V_t add kappa to lambda. With a share a of the shear modulus in the areas this gives
///
///     K_length = 15 (1 - a) mu v_e,   K_area = 15 a mu v_f,   K_volume = (lambda - (1 + 5a) mu) V_t;
///
/// all scale with the volume of the element, so that refining the mesh keeps the stiffness of the body. The springs
/// alone already have Poisson ratio 1/4, and areas more, which is the least that each model can express. The average is
/// over all directions alike: on a mesh that prefers some, the body is stiffer than it says by some per cent; the
/// neo-Hookean model is not.
struct Material {
  Real young = 1e5;     // E [Pa]
  Real poisson = 0.35;  // nu
  Real density = 1000;  // [kg/m³]
  Real damping = 0;     // ratio of damping to stiffness of every element, beta [s]

  static constexpr Real area_share = 0.1;  // a

  Real lame_mu() const { return young / (2 * (1 + poisson)); }
  Real lame_lambda() const { return young * poisson / ((1 + poisson) * (1 - 2 * poisson)); }

  /// K per rest volume [J/m³], of the edges, the faces and the tetrahedra.
  Real length_stiffness_density(ElasticModel model = ElasticModel::springs_volumes) const {
    return 15 * (1 - share(model)) * lame_mu();
  }
  Real area_stiffness_density(ElasticModel model = ElasticModel::springs_volumes) const {
    return 15 * share(model) * lame_mu();
  }
  Real volume_stiffness_density(ElasticModel model = ElasticModel::springs_volumes) const {
    return lame_lambda() - (1 + 5 * share(model)) * lame_mu();
  }

  static Real least_poisson(ElasticModel model) {
    if (model == ElasticModel::neo_hookean) return 0;
    const Real ratio = 1 + 5 * share(model);  // lambda / mu without volumes
    return ratio / (2 * (1 + ratio));
  }

  /// Throws std::invalid_argument that names the number out of range.
  void check(ElasticModel model = ElasticModel::springs_volumes) const { check(least_poisson(model), name_of(model)); }
  void check(Real least_poisson, const char* model) const {
    const auto require = [](bool ok, const char* name, Real value, const std::string& range) {
      if (!ok)
        throw std::invalid_argument(std::string("material: ") + name + " is " + to_text(value) + ", must be " + range);
    };
    require(young > 0 && young < 1e300, "Young's modulus", young, "positive and finite [Pa]");
    require(poisson >= least_poisson * (1 - 1e-9) && poisson < 0.5, "Poisson's ratio", poisson,
            "in [" + to_text(least_poisson) + ", 0.5) for " + model);
    require(density > 0 && density < 1e300, "density", density, "positive and finite [kg/m³]");
    require(damping >= 0 && damping < 1e300, "damping", damping, "zero or positive [s]");
  }

  static const char* name_of(ElasticModel model) {
    switch (model) {
      case ElasticModel::springs_volumes:
        return "springs and volumes";
      case ElasticModel::springs_areas_volumes:
        return "springs, areas and volumes";
      case ElasticModel::neo_hookean:
        return "the neo-Hookean model";
    }
    return "";
  }

 private:
  static constexpr Real share(ElasticModel model) {
    return model == ElasticModel::springs_areas_volumes ? area_share : 0;
  }
};

/// What the tetrahedra of a body are made of, one by one: `penalty/mesh/regions.h` takes it from the regions of a mesh.
struct Materials {
  std::vector<Material> kinds;
  std::vector<int> kind_of;  // of tetrahedron t: kinds[kind_of[t]]

  const Material& of(std::size_t tetrahedron) const { return kinds[kind_of[tetrahedron]]; }

  /// Throws std::invalid_argument unless each of `tetrahedra` has one of the materials, and these are good for `model`.
  void check(std::size_t tetrahedra, ElasticModel model) const;
};

}  // namespace penalty
