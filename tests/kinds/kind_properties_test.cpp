// The laws that every kind obeys. A new kind is in here as soon as it is in the list of kinds.
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
    const Gradient<TestFixture::n> gradient = s.kind.gradient(s.points);
    ASSERT_GT(gradient.norm() * s.size, 0.01);
    const auto value = [&](const auto& p) { return s.kind.value(p); };
    error.see(
        relative_error(central_difference_gradient<TestFixture::n>(value, s.points, s.difference_step()), gradient),
        seed);
  }
  error.expect_below(1e-7, "relative error");
}

TYPED_TEST(KindProperties, HessianIsTheDerivativeOfTheGradient) {
  static_assert(HasHessian<TypeParam>);
  WorstError error, asymmetry;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Hessian<TestFixture::n> hessian = s.kind.hessian(s.points);
    ASSERT_GT(hessian.norm() * s.size * s.size, 0.01);
    const auto gradient = [&](const auto& p) -> Gradient<TestFixture::n> { return s.kind.gradient(p); };
    error.see(
        relative_error(central_difference_hessian<TestFixture::n>(gradient, s.points, s.difference_step()), hessian),
        seed);
    asymmetry.see(relative_error(hessian.transpose(), hessian), seed);
  }
  error.expect_below(1e-7, "relative error");
  asymmetry.expect_below(1e-14, "asymmetry");
}

TYPED_TEST(KindProperties, GradientHasNoNetForceAndNoNetTorque) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Gradient<TestFixture::n> gradient = s.kind.gradient(s.points);
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
    const Real value = s.kind.value(s.points);
    value_error.see(std::abs(kind.value(elsewhere) - value) / (1 + std::abs(value)), seed);
    gradient_error.see(relative_error(kind.gradient(elsewhere), rotation * s.kind.gradient(s.points)), seed);
  }
  value_error.expect_below(1e-12, "value");
  gradient_error.expect_below(1e-12, "gradient");
}

TYPED_TEST(KindProperties, ValueDoesNotDependOnTheUnitOfLength) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Real value = s.kind.value(s.points);
    const Real in_millimetres = prototype<TypeParam>(1e3 * s.size).at_rest(1e3 * s.rest).value(1e3 * s.points);
    error.see(std::abs(in_millimetres - value) / (1 + std::abs(value)), seed);
  }
  error.expect_below(1e-12, "value");
}

TYPED_TEST(KindProperties, ValueIsZeroAtRestAndNotElsewhere) {
  WorstError error;
  int far_from_rest = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    error.see(std::abs(s.kind.value(s.rest)), seed);
    far_from_rest += std::abs(s.kind.value(s.points)) > 0.01;
  }
  error.expect_below(1e-14, "value at rest");
  EXPECT_GT(far_from_rest, static_cast<int>(num_samples) / 2);
}

TYPED_TEST(KindProperties, ValueAndGradientTogetherAreThoseOfTheTwoFunctions) {
  WorstError value_error, gradient_error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    Gradient<TestFixture::n> gradient;
    gradient.setConstant(std::numeric_limits<Real>::quiet_NaN());  // must be overwritten
    const Real value = value_and_gradient(s.kind, s.points, gradient);
    value_error.see(std::abs(value - s.kind.value(s.points)) / (1 + std::abs(value)), seed);
    gradient_error.see(relative_error(gradient, s.kind.gradient(s.points)), seed);
  }
  value_error.expect_below(1e-14, "value");
  gradient_error.expect_below(1e-15, "gradient");
}

TYPED_TEST(KindProperties, DegenerateStencilsAreFinite) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    for (const Points<TestFixture::n>& points : degenerate_points<TestFixture::n>(s.size)) {
      EXPECT_TRUE(std::isfinite(s.kind.value(points))) << points;
      EXPECT_TRUE(s.kind.gradient(points).allFinite()) << points;
      if constexpr (HasHessian<TypeParam>) {
        EXPECT_TRUE(s.kind.hessian(points).allFinite()) << points;
      }
    }
  }
}

TYPED_TEST(KindProperties, AtRestRefusesDegenerateAndNonFinitePointsAndSaysWhat) {
  const auto refusal = [](const Points<TestFixture::n>& rest) {
    return complaint<std::invalid_argument>([&] { prototype<TypeParam>(1).at_rest(rest); });
  };
  const Points<TestFixture::n> coincident = Points<TestFixture::n>::Ones();
  const std::string zero = refusal(coincident);
  EXPECT_TRUE(zero.starts_with(TypeParam::name)) << zero;
  EXPECT_NE(zero.find(" is 0"), std::string::npos) << zero;
  for (const Real bad : {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
                         -std::numeric_limits<Real>::infinity()}) {
    for (int k = 0; k < TestFixture::n; ++k) {
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
