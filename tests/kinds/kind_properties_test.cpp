// The laws that every kind obeys, constraints and energies alike. A new kind is in here as soon as it is in the list.
#include <limits>

#include "kinds/samples.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

template <class Kind>
class KindProperties : public ::testing::Test {
 protected:
  static constexpr int n = Kind::num_points;
};
TYPED_TEST_SUITE(KindProperties, KindTypes);

TYPED_TEST(KindProperties, GradientIsTheDerivativeOfTheValue) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Gradient<TestFixture::n> gradient = gradient_of(s.kind, s.points);
    ASSERT_GT(gradient.norm() * s.size, 0.01);
    const auto value = [&](const auto& p) { return measure(s.kind, p); };
    error.see(
        relative_error(central_difference_gradient<TestFixture::n>(value, s.points, s.difference_step()), gradient),
        seed);
  }
  error.expect_below(1e-7, "relative error");
}

TYPED_TEST(KindProperties, HessianIsTheDerivativeOfTheGradient) {
  if constexpr (has_hessian<TypeParam>) {  // a kind may do without
    WorstError error, asymmetry;
    for (unsigned seed = 0; seed < num_samples; ++seed) {
      const auto s = sample<TypeParam>(seed);
      SCOPED_TRACE(trace(s));
      const Hessian<TestFixture::n> hessian = hessian_of(s.kind, s.points);
      ASSERT_GT(hessian.norm() * s.size * s.size, 0.01);
      const auto gradient = [&](const auto& p) { return gradient_of(s.kind, p); };
      error.see(
          relative_error(central_difference_hessian<TestFixture::n>(gradient, s.points, s.difference_step()), hessian),
          seed);
      asymmetry.see(relative_error(hessian.transpose(), hessian), seed);
    }
    error.expect_below(1e-7, "relative error");
    asymmetry.expect_below(1e-13, "asymmetry");
  }
}

TYPED_TEST(KindProperties, GradientHasNoNetForceAndNoNetTorque) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Gradient<TestFixture::n> gradient = gradient_of(s.kind, s.points);
    if constexpr (conserves_momentum<TypeParam>) {
      force.see(net_force<TestFixture::n>(gradient), seed);
      torque.see(net_torque<TestFixture::n>(s.points, gradient), seed);
    } else {  // the reaction acts at the target
      torque.see(net_torque<TestFixture::n>(s.points.colwise() - s.kind.target, gradient), seed);
    }
  }
  if constexpr (conserves_momentum<TypeParam>) force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TYPED_TEST(KindProperties, ValueIsInvariantAndGradientTurnsUnderRigidMotion) {
  WorstError value_error, gradient_error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    Random random(seed + 1000);
    const Matrix3 rotation = random.rotation();
    const Vector3 translation = random.vector(2 * s.size);
    const Points<TestFixture::n> turned = rotation * s.points;
    const Points<TestFixture::n> elsewhere = turned.colwise() + translation;
    const TypeParam kind = moved(s.kind, rotation, translation);
    const Real value = measure(s.kind, s.points);
    value_error.see(std::abs(measure(kind, elsewhere) - value) / (1 + std::abs(value)), seed);
    gradient_error.see(relative_error(gradient_of(kind, elsewhere), rotation * gradient_of(s.kind, s.points)), seed);
  }
  value_error.expect_below(1e-12, "value");
  gradient_error.expect_below(1e-12, "gradient");
}

TYPED_TEST(KindProperties, ValueDoesNotDependOnTheUnitOfLength) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Real value = measure(s.kind, s.points);
    const TypeParam scaled = example_of<TypeParam>(1e3 * s.size).at_rest(1e3 * s.rest);
    const Real in_millimetres = measure(scaled, Points<TestFixture::n>(1e3 * s.points));
    error.see(std::abs(in_millimetres - value) / (1 + std::abs(value)), seed);
  }
  error.expect_below(1e-12, "value");
}

TYPED_TEST(KindProperties, ValueIsZeroAtRestAndNotElsewhere) {
  WorstError error;
  int far_from_rest = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    error.see(std::abs(measure(s.kind, s.rest)), seed);
    far_from_rest += std::abs(measure(s.kind, s.points)) > 0.01;
  }
  error.expect_below(1e-14, "value at rest");
  EXPECT_GT(far_from_rest, static_cast<int>(num_samples) / 2);
}

// Most kinds write their gradient once, together with the value, and hand it out of there. That the gradient is right
// is tested above; here, that the pass in which the solvers ask for both overwrites what it is given and has the value
// of `value`, which is a function of its own.
TYPED_TEST(KindProperties, ValueInOnePassWithTheGradientIsTheValue) {
  WorstError value_error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    Gradient<TestFixture::n> gradient(3, s.points.cols());
    gradient.setConstant(std::numeric_limits<Real>::quiet_NaN());  // must be overwritten
    Real value = 0;
    if constexpr (Constraint<TypeParam>)
      value = value_and_gradient(s.kind, s.points, gradient);
    else
      value = s.kind.energy_and_gradient(s.points, gradient);
    const Real expected = measure(s.kind, s.points);
    value_error.see(std::abs(value - expected) / (1 + std::abs(expected)), seed);
    EXPECT_TRUE(gradient.allFinite()) << trace(s);
  }
  value_error.expect_below(1e-14, "value");
}

TYPED_TEST(KindProperties, DegenerateStencilsAreFinite) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    for (const Points<TestFixture::n>& points :
         degenerate_points<TestFixture::n>(num_example_points<TypeParam>, s.size)) {
      EXPECT_TRUE(std::isfinite(measure(s.kind, points))) << points;
      EXPECT_TRUE(gradient_of(s.kind, points).allFinite()) << points;
      if constexpr (has_hessian<TypeParam>) {
        EXPECT_TRUE(hessian_of(s.kind, points).allFinite()) << points;
      }
    }
  }
}

TYPED_TEST(KindProperties, AtRestRefusesDegenerateAndNonFinitePointsAndSaysWhat) {
  const auto refusal = [](const Points<TestFixture::n>& rest) {
    return complaint<std::invalid_argument>([&] { example_of<TypeParam>(1).at_rest(rest); });
  };
  const Points<TestFixture::n> coincident = Points<TestFixture::n>::Ones(3, num_example_points<TypeParam>);
  bool rests_there = true;
  try {
    EXPECT_EQ(measure(example_of<TypeParam>(1).at_rest(coincident), coincident), 0);
  } catch (const std::invalid_argument& error) {
    rests_there = false;
    EXPECT_TRUE(std::string(error.what()).starts_with(TypeParam::name)) << error.what();
  }
  // Only what holds points together may be at rest with all of them in one place.
  EXPECT_EQ(rests_there, rests_in_one_place<TypeParam>);
  for (const Real bad : {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
                         -std::numeric_limits<Real>::infinity()}) {
    for (int k = 0; k < num_example_points<TypeParam>; ++k) {
      Points<TestFixture::n> rest = sample<TypeParam>(3).rest;
      rest(1, k) = bad;
      const std::string message = refusal(rest);
      EXPECT_TRUE(message.starts_with(TypeParam::name)) << message;
      EXPECT_TRUE(message.find("nan") != std::string::npos || message.find("inf") != std::string::npos) << message;
    }
  }
}

}  // namespace
}  // namespace penalty::testing
