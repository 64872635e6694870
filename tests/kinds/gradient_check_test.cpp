#include "penalty/kinds/gradient_check.h"

#include <limits>

#include "kinds/samples.h"
#include "penalty/kinds/enclosed_volume.h"
#include "penalty/kinds/length.h"
#include "penalty/kinds/tetrahedron_volume.h"
#include "penalty/kinds/user_constraint.h"

namespace penalty::testing {
namespace {

constexpr auto angle_of = [](const auto& p) {
  const auto e = (p.col(1) - p.col(0)).eval(), f = (p.col(2) - p.col(0)).eval();
  return atan2(e.cross(f).norm(), e.dot(f));
};

std::string refusal(const auto& kind, const auto& points) {
  return complaint<std::invalid_argument>([&] { check_gradient(kind, points, "user constraint 3"); });
}

// Four points with the least distance `least` between any three and the fourth, in a cube of side 2.
Points<4> tetrahedron(Random& random, Real least) {
  for (;;) {
    const Points<4> p = random.vectors<4>(4, 1);
    if (std::abs(volume_of(p)) > least) return p;
  }
}

TEST(GradientCheck, AcceptsRightGradientsOfAnySizeAndAnywhere) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Real size = std::pow(10.0, random.uniform(-3, 3));
    const Points<4> rest = (size * tetrahedron(random, 0.02)).colwise() + size * random.vector(100);
    const Points<2> edge = rest.leftCols<2>();
    const Points<3> corner = rest.leftCols<3>();
    EXPECT_NO_THROW(check_gradient(Length::at_rest(edge), edge, "length"));
    EXPECT_NO_THROW(check_gradient(TetrahedronVolume::at_rest(rest), rest, "volume"));
    EXPECT_NO_THROW(check_gradient(differentiated_constraint<3>(angle_of).at_rest(corner), corner, "angle"));
    EXPECT_NO_THROW(check_gradient(difference_constraint<3>(angle_of).at_rest(corner), corner, "angle"));
    const EnclosedVolume surface =
        EnclosedVolume({{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}).at_rest(Points<dynamic>(rest));
    EXPECT_NO_THROW(check_gradient(surface, Points<dynamic>(rest), "surface"));
  }
}

TEST(GradientCheck, AcceptsThinStencilsAndGradientsThatVanishAtRest) {
  Points<3> thin;  // one leg a hundredth of the other
  thin << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0.003, 0.01, 0);
  EXPECT_NO_THROW(check_gradient(differentiated_constraint<3>(angle_of).at_rest(thin), thin, "angle"));
  // cos of a straight angle: stationary.
  Points<3> straight;
  straight << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(-1, 0, 0);
  const auto cosine = differentiated_constraint<3>([](const auto& p) {
    const auto e = (p.col(1) - p.col(0)).eval(), f = (p.col(2) - p.col(0)).eval();
    return e.dot(f) / (e.norm() * f.norm());
  });
  EXPECT_NO_THROW(check_gradient(cosine.at_rest(straight), straight, "cosine"));
  // One point, far away or at the origin.
  const auto height = differentiated_constraint<1>([](const auto& p) { return p(2); });
  for (const Points<1>& point : {Points<1>(0, 0, 0), Points<1>(0, 0, 1e-3), Points<1>(1e6, -3, 2)})
    EXPECT_NO_THROW(check_gradient(height.at_rest(point), point, "height"));
}

TEST(GradientCheck, AcceptsValuesThatAreLargeAtRest) {
  // f loses eight digits to a constant: still no false alarm.
  const auto kind = differentiated_constraint<4>([](const auto& p) { return 1e8 + volume_of(p); });
  for (unsigned seed = 0; seed < 30; ++seed) {
    Random random(seed);
    const Points<4> rest = tetrahedron(random, 0.1);
    EXPECT_NO_THROW(check_gradient(kind.at_rest(rest), rest, "volume")) << seed;
  }
}

// The volume with a gradient that something was done to.
template <int N = 4, class Change>
auto volume_with(const Change& change) {
  return user_constraint<N>(volume_of, [change](const Points<N>& p) {
    Gradient<N> g = differentiated_constraint<N>(volume_of).gradient(p);
    change(p, g);
    return g;
  });
}

TEST(GradientCheck, RefusesGradientsThatAreWrong) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const Real size = std::pow(10.0, random.uniform(-3, 3));
    const Points<4> rest = size * tetrahedron(random, 0.05);
    const auto expect_refused = [&](const auto& change) {
      const auto kind = volume_with(change);
      const std::string message = refusal(kind.at_rest(rest), rest);
      EXPECT_TRUE(message.starts_with("user constraint 3: ")) << message;
      const auto any = volume_with<dynamic>(change);
      EXPECT_EQ(refusal(any.at_rest(rest), Points<dynamic>(rest)), message);
    };
    EXPECT_NO_THROW(check_gradient(volume_with([](const auto&, auto&) {}).at_rest(rest), rest, "right"));
    expect_refused([](const auto&, auto& g) { g = -g; });
    expect_refused([](const auto&, auto& g) { g *= 2; });
    expect_refused([](const auto&, auto& g) { g *= 1.01; });
    expect_refused([](const auto&, auto& g) { g.setZero(); });
    expect_refused([](const auto&, auto& g) { g.col(1).swap(g.col(2)); });
    expect_refused([](const auto&, auto& g) { g.col(3) *= -1; });
    expect_refused([](const auto&, auto& g) { g += 0.01 * g.norm() * g.Ones(3, 4); });
    expect_refused([](const auto&, auto& g) { g(2, 1) += 0.01 * g.norm(); });
    // Right at rest, wrong elsewhere.
    const Gradient<4> frozen = differentiated_constraint<4>(volume_of).gradient(rest);
    expect_refused([frozen](const auto&, auto& g) { g.reshaped() = frozen.reshaped(); });
  }
}

TEST(GradientCheck, NamesTheWorstEntryAndBothNumbers) {
  Points<4> rest;  // dV = 1/6 for the coordinate of each leg
  rest << Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1);
  const auto doubled = volume_with([](const auto&, auto& g) { g(1, 2) += 0.5; });
  EXPECT_EQ(refusal(doubled.at_rest(rest), rest),
            "user constraint 3: at rest, dC/dp2.y is 0.666667, central differences give 0.166667");
  const auto not_finite = volume_with([](const auto&, auto& g) { g(0, 3) = std::numeric_limits<Real>::infinity(); });
  EXPECT_EQ(refusal(not_finite.at_rest(rest), rest),
            "user constraint 3: at rest, dC/dp3.x is inf, central differences give 0");
  const auto nan = volume_with([](const auto&, auto& g) { g(2, 0) = std::numeric_limits<Real>::quiet_NaN(); });
  EXPECT_TRUE(refusal(nan.at_rest(rest), rest).starts_with("user constraint 3: at rest, dC/dp0.z is nan"));
  const auto elsewhere = volume_with([rest](const auto& p, auto& g) {
    if (p != rest) g(0, 1) = 7;
  });
  EXPECT_TRUE(refusal(elsewhere.at_rest(rest), rest).starts_with("user constraint 3: near rest, dC/dp1.x is 7, "));
}

TEST(GradientCheck, LooksAtSixtyFourOfManyPoints) {
  int calls = 0;
  const auto sum_of_squares = [&calls](const Points<dynamic>& p) {
    ++calls;
    return p.squaredNorm();
  };
  const Points<dynamic> rest = Random(1).vectors<dynamic>(1000, 1);
  const auto right =
      user_constraint<dynamic>(sum_of_squares, [](const Points<dynamic>& p) { return Gradient<dynamic>(2 * p); });
  EXPECT_NO_THROW(check_gradient(right.at_rest(rest), rest, "squares"));
  EXPECT_LT(calls, 64 * 6 * 4);
  const auto wrong =
      user_constraint<dynamic>(sum_of_squares, [](const Points<dynamic>& p) { return Gradient<dynamic>(3 * p); });
  EXPECT_NE(refusal(wrong.at_rest(rest), rest), "");
}

}  // namespace
}  // namespace penalty::testing
