// Profiles, plastic flow and breaking, by hand.
#include "penalty/energy/modifiers.h"

#include "math/random.h"
#include "penalty/energy/penalty_energy.h"
#include "penalty/kinds/length.h"

namespace penalty::testing {
namespace {

TEST(Profile, ResistsWhatIsOutsideItsFreePlay) {
  const Profile rope{.lower = -infinite}, stop{.upper = infinite},
      between{.target = 0.5, .lower = -0.125, .upper = 0.25};
  EXPECT_EQ(rope.strain(-0.7), 0);
  EXPECT_EQ(rope.strain(0.3), 0.3);
  EXPECT_EQ(stop.strain(-0.7), -0.7);
  EXPECT_EQ(stop.strain(0.3), 0);
  EXPECT_EQ(between.strain(0.6), 0);
  EXPECT_NEAR(between.strain(0.85), 0.1, 1e-15);
  EXPECT_NEAR(between.strain(0.275), -0.1, 1e-15);
  EXPECT_TRUE(between.is_slack(0.6));
  EXPECT_FALSE(between.is_slack(0.75));
  EXPECT_FALSE(Profile{}.is_slack(0)) << "a plain element is never slack: at rest it has its full stiffness";
}

TEST(Profile, EnergyAndForceAreContinuousAtTheEndsOfFreePlay) {
  Points<2> rest, points;
  rest << Vector3::Zero(), Vector3::UnitX();
  const Length spring = Length::at_rest(rest);
  const Profile profile{.target = 0.3, .lower = -0.1, .upper = 0.2};
  for (const Real end : {1.2, 1.5})
    for (const Real off : {-1e-9, 1e-9}) {
      points << Vector3::Zero(), (end + off) * Vector3::UnitX();
      EXPECT_LT(energy(spring, 10, points, profile), 1e-16);
      EXPECT_LT(force(spring, 10, points, profile).norm(), 1e-7);
    }
}

TEST(Plasticity, ElasticBelowTheYieldStrain) {
  const Plasticity metal{.yield = 0.1};
  for (const Real s : {-0.1, -0.05, 0.0, 0.1}) EXPECT_EQ(metal.flow(0.02, s, 1), 0.02);
}

TEST(Plasticity, WithoutCreepGoesDownToTheYieldStrainAtOnce) {
  const Plasticity metal{.yield = 0.1};
  EXPECT_NEAR(metal.flow(0, 0.35, 1e-9), 0.25, 1e-15);
  EXPECT_NEAR(metal.flow(0.05, -0.35, 1e-9), -0.2, 1e-15);
}

TEST(Plasticity, CreepsExponentiallyWhateverTheStep) {
  // ds/dt = -creep s at unchanged C, until s = yield.
  const Plasticity clay{.yield = 0.1, .creep = 3};
  const Real c = 0.4;
  for (const int steps : {1, 7, 1000}) {
    Real plastic = 0;
    for (int k = 0; k < steps; ++k) plastic = clay.flow(plastic, c - plastic, 0.2 / steps);
    EXPECT_NEAR(c - plastic, 0.4 * std::exp(-3 * 0.2), 1e-13) << steps << " steps";
  }
  EXPECT_NEAR(clay.flow(0, c, 1e9), 0.3, 1e-15);
}

TEST(Plasticity, StopsAtItsLimitAndNeverJumpsBack) {
  const Plasticity clay{.yield = 0.1, .limit = 0.15};
  EXPECT_EQ(clay.flow(0, 0.9, 1), 0.15);
  EXPECT_EQ(clay.flow(0, -0.9, 1), -0.15);
  EXPECT_EQ(clay.flow(0.4, 0.9, 1), 0.4);  // the limit was lowered after the flow
}

TEST(Plasticity, NeverAddsEnergy) {
  Random random(3);
  for (int k = 0; k < 1000; ++k) {
    const Plasticity p{.yield = random.uniform(0, 0.5), .creep = random.uniform(0, 100), .limit = random.uniform(0, 1)};
    const Real plastic = random.uniform(-1, 1), s = random.uniform(-2, 2);
    const Real left = s - (p.flow(plastic, s, random.uniform(0, 0.1)) - plastic);
    EXPECT_LE(std::abs(left), std::abs(s));
    EXPECT_GE(left * s, 0);
  }
}

TEST(Breaking, HasOneThresholdForEachDirection) {
  const Breaking thread{.upper = 0.3}, glass{.upper = 0.1, .lower = -0.2};
  EXPECT_FALSE(thread.breaks(-100));
  EXPECT_FALSE(thread.breaks(0.3));
  EXPECT_TRUE(thread.breaks(0.31));
  EXPECT_TRUE(glass.breaks(-0.21));
}

TEST(Modifiers, NumbersOutOfRangeAreNamed) {
  EXPECT_EQ(complaint<std::invalid_argument>([] { Plasticity{.yield = -1}.check(); }),
            "plasticity: yield is -1, must be zero or positive");
  EXPECT_EQ(complaint<std::invalid_argument>([] { Plasticity{.creep = std::nan("")}.check(); }),
            "plasticity: creep is nan, must be zero or positive");
  EXPECT_EQ(complaint<std::invalid_argument>([] { Plasticity{.limit = -0.5}.check(); }),
            "plasticity: limit is -0.5, must be zero or positive");
  EXPECT_EQ(complaint<std::invalid_argument>([] { Breaking{.upper = 0}.check(); }),
            "breaking: upper strain is 0, must be positive");
  EXPECT_EQ(complaint<std::invalid_argument>([] { Breaking{.lower = 0.1}.check(); }),
            "breaking: lower strain is 0.1, must be negative");
}

}  // namespace
}  // namespace penalty::testing
