#include "penalty/energy/material.h"

#include <limits>

#include "math/random.h"

namespace penalty::testing {
namespace {

TEST(Material, LameParametersOfYoungAndPoisson) {
  const Material material{.young = 1e5, .poisson = 0.25};
  EXPECT_DOUBLE_EQ(material.lame_mu(), 4e4);
  EXPECT_DOUBLE_EQ(material.lame_lambda(), 4e4);
  // And back: E = mu (3 lambda + 2 mu) / (lambda + mu), nu = lambda / 2(lambda + mu).
  for (const Real poisson : {0.25, 0.3, 0.4, 0.49}) {
    const Material m{.young = 7e6, .poisson = poisson};
    const Real mu = m.lame_mu(), lambda = m.lame_lambda();
    EXPECT_NEAR(mu * (3 * lambda + 2 * mu) / (lambda + mu), 7e6, 1e-8);
    EXPECT_NEAR(lambda / (2 * (lambda + mu)), poisson, 1e-15);
  }
}

TEST(Material, SpringsCarryTheShearModulusAndVolumesWhatIsLeftOfLambda) {
  const Material material{.young = 2.6e5, .poisson = 0.3};  // mu = 1e5, lambda = 1.5e5
  EXPECT_DOUBLE_EQ(material.length_stiffness_density(), 15e5);
  EXPECT_NEAR(material.volume_stiffness_density(), 0.5e5, 1e-9);
}

TEST(Material, AtPoissonOneQuarterSpringsAreAll) {
  const Material material{.young = 1, .poisson = 0.25};
  EXPECT_NEAR(material.volume_stiffness_density(), 0, 1e-15);
}

std::string refusal(const Material& material) {
  return complaint<std::invalid_argument>([&] { material.check(); });
}

TEST(Material, NumbersOutOfRangeAreNamed) {
  EXPECT_NO_THROW(Material{}.check());
  EXPECT_NO_THROW((Material{.young = 1, .poisson = 0.25, .density = 1}.check()));
  EXPECT_EQ(refusal({.young = 0}), "material: Young's modulus is 0, must be positive and finite [Pa]");
  EXPECT_EQ(refusal({.young = std::numeric_limits<Real>::infinity()}),
            "material: Young's modulus is inf, must be positive and finite [Pa]");
  EXPECT_EQ(refusal({.poisson = 0.5}),
            "material: Poisson's ratio is 0.5, must be in [0.25, 0.5) for springs and volumes");
  EXPECT_EQ(refusal({.poisson = 0.2}),
            "material: Poisson's ratio is 0.2, must be in [0.25, 0.5) for springs and volumes");
  EXPECT_EQ(refusal({.density = -1}), "material: density is -1, must be positive and finite [kg/m³]");
  for (const Real bad : {-1.0, std::nan("")}) {
    EXPECT_NE(refusal({.young = bad}).find("Young's modulus"), std::string::npos);
    EXPECT_NE(refusal({.poisson = bad}).find("Poisson's ratio"), std::string::npos);
    EXPECT_NE(refusal({.density = bad}).find("density"), std::string::npos);
  }
}

}  // namespace
}  // namespace penalty::testing
