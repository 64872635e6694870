#include "penalty/kinds/distance.h"

#include <limits>

#include "kinds/samples.h"

namespace penalty::testing {
namespace {

const Vector3 target(1, 2, 3);

// d²E/dp² for K = 1.
Matrix3 stiffness(const Distance& kind, const Vector3& p) {
  const Vector3 g = kind.gradient(p);
  return g * g.transpose() + kind.value(p) * kind.hessian(p);
}

TEST(Distance, IsTheRelativeChangeOfTheDistance) {
  const Distance kind = Distance::to(target).at_rest(Vector3(1, 2, 5));
  EXPECT_DOUBLE_EQ(kind.rest_distance(), 2);
  EXPECT_DOUBLE_EQ(kind.value(Vector3(4, 2, 3)), 0.5);
  EXPECT_DOUBLE_EQ(kind.value(Vector3(1, 1, 3)), -0.5);
  EXPECT_DOUBLE_EQ(kind.value(target), -1);
}

TEST(Distance, IsTheLengthOfASpringWithOneEndHeld) {
  WorstError value, gradient, hessian;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<Distance>(seed);
    Points<2> rest, points;
    rest << s.kind.target, s.rest;
    points << s.kind.target, s.points;
    const Length length = Length::at_rest(rest);
    value.see(std::abs(s.kind.value(s.points) - length.value(points)), seed);
    gradient.see(relative_error(s.kind.gradient(s.points), length.gradient(points).col(1)), seed);
    hessian.see(relative_error(s.kind.hessian(s.points), length.hessian(points).bottomRightCorner<3, 3>()), seed);
  }
  value.expect_below(1e-14, "value");
  gradient.expect_below(1e-14, "gradient");
  hessian.expect_below(1e-13, "hessian");
}

TEST(Distance, FollowsItsTarget) {
  Distance kind = Distance::to(target).at_rest(Vector3(1, 2, 5));
  kind.target += Vector3(10, 20, 30);
  EXPECT_DOUBLE_EQ(kind.value(Vector3(11, 22, 35)), 0);
  EXPECT_DOUBLE_EQ(kind.value(Vector3(11, 22, 37)), 1);
  EXPECT_LT((kind.gradient(Vector3(15, 22, 33)) - Vector3(0.5, 0, 0)).norm(), 1e-15);
}

TEST(Distance, APrototypeHasNoForce) {
  const Distance prototype = Distance::to(target);
  EXPECT_EQ(prototype.value(Vector3(7, 8, 9)), 0);
  EXPECT_TRUE(prototype.gradient(Vector3(7, 8, 9)).isZero(0));
  EXPECT_EQ(prototype.rest_distance(), 0);
}

TEST(Distance, OfCoincidentPointsPushesApartAlongTheDirectionAtRest) {
  const Distance kind = Distance::to(target).at_rest(Vector3(1, 2, 5));
  EXPECT_EQ(kind.gradient(target), Vector3(0, 0, 0.5));
  EXPECT_EQ(kind.value(target), -1);
  EXPECT_TRUE(kind.hessian(target).isZero(0));
}

TEST(PinnedDistance, IsASpringOfTheSameStiffnessInEveryDirection) {
  // E = K/2 |p - q|² / length²: force K (p - q) / length², second derivative K / length².
  const Real length = 0.25;
  const Distance pin = Distance::pinned(target, length);
  EXPECT_EQ(pin.rest_distance(), 0);
  WorstError force_error, stiffness_error;
  for (unsigned seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const Vector3 offset = std::pow(10.0, random.uniform(-12, 3)) * random.direction();
    Distance here = pin;
    here.target.setZero();  // so that the offset is exact, however small
    const Vector3 gradient = here.value(offset) * here.gradient(offset);
    force_error.see(relative_error(gradient, offset / (length * length)), seed);
    stiffness_error.see(relative_error(stiffness(here, offset), Matrix3::Identity() / (length * length)), seed);
  }
  force_error.expect_below(1e-14, "force");
  stiffness_error.expect_below(1e-14, "stiffness");
}

TEST(PinnedDistance, AtTheTargetThereIsNoForceButAStiffness) {
  const Distance pin = Distance::pinned(target, 0.25);
  EXPECT_EQ(pin.value(target), 0);
  EXPECT_TRUE(pin.hessian(target).allFinite());
  const Vector3 g = pin.gradient(target);
  EXPECT_DOUBLE_EQ(g.squaredNorm(), 16);  // K / length² of Gauss-Newton
  EXPECT_DOUBLE_EQ(stiffness(pin, target).trace(), 16);
}

TEST(Distance, DoesNotConserveMomentum) {
  EXPECT_FALSE(conserves_momentum<Distance>);
  EXPECT_TRUE(conserves_momentum<Length>);
}

TEST(Distance, RefusesImpossibleNumbersByName) {
  const Real infinity = std::numeric_limits<Real>::infinity(), nan = std::numeric_limits<Real>::quiet_NaN();
  const auto refusal = [](const auto& make) { return complaint<std::invalid_argument>(make); };
  EXPECT_EQ(refusal([] { Distance::to(target).at_rest(target); }), "distance: rest distance is 0");
  EXPECT_EQ(refusal([&] { Distance::to({0, nan, 0}); }), "distance: coordinate 1 of the target is nan");
  EXPECT_EQ(refusal([&] { Distance::pinned({0, 0, infinity}, 1); }), "distance: coordinate 2 of the target is inf");
  EXPECT_EQ(refusal([&] { Distance::pinned(target, infinity); }),
            "distance: length is inf, must be positive and finite");
  EXPECT_EQ(refusal([&] { Distance::pinned(target, nan); }), "distance: length is nan, must be positive and finite");
  EXPECT_EQ(refusal([] { Distance::pinned(target, 0); }), "distance: length is 0, must be positive and finite");
  EXPECT_EQ(refusal([] { Distance::pinned(target, -2); }), "distance: length is -2, must be positive and finite");
}

}  // namespace
}  // namespace penalty::testing
