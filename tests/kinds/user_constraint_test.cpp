#include "penalty/kinds/user_constraint.h"

#include <limits>
#include <vector>

#include "kinds/samples.h"
#include "penalty/kinds/enclosed_volume.h"
#include "penalty/kinds/length.h"
#include "penalty/kinds/tetrahedron_volume.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

constexpr auto length_of = [](const auto& p) { return (p.col(1) - p.col(0)).norm(); };
constexpr auto area_of = [](const auto& p) { return (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)).norm() / 2; };

Gradient<2> gradient_of_length(const Points<2>& p) {
  const Vector3 n = (p.col(1) - p.col(0)).normalized();
  Gradient<2> g;
  g << -n, n;
  return g;
}

using DifferentiatedLength = decltype(differentiated_constraint<2>(length_of));
static_assert(Constraint<DifferentiatedLength> && HasHessian<DifferentiatedLength> &&
              HasValueAndGradient<DifferentiatedLength>);
using DifferenceLength = decltype(difference_constraint<2>(length_of));
static_assert(Constraint<DifferenceLength> && !HasHessian<DifferenceLength> && HasValueAndGradient<DifferenceLength>);
using HandWrittenLength = decltype(user_constraint<2>(length_of, &gradient_of_length));
static_assert(Constraint<HandWrittenLength> && !HasHessian<HandWrittenLength>);
static_assert(sizeof(DifferentiatedLength) == 3 * sizeof(Real), "a callable without captures takes no room");
static_assert(HasHessian<decltype(differentiated_constraint<dynamic>(length_of))>);

// C = (|N| - A0) / A0 of a triangle, N half the cross product, from its closed form: gradient_i = 1/2 n x e_i with the
// opposite edge e_i, Hessian_ij = (e_i . e_j) / 4A n nᵀ - 1/2 s_ij [n], s = 1 for j = i + 1 and -1 for j = i - 1.
struct ClosedArea {
  Real rest_area;
  Vector3 edge(const Points<3>& p, int i) const { return p.col((i + 2) % 3) - p.col((i + 1) % 3); }
  Vector3 normal(const Points<3>& p) const { return edge(p, 0).cross(edge(p, 1)).normalized(); }
  Gradient<3> gradient(const Points<3>& p) const {
    Gradient<3> g;
    for (int i = 0; i < 3; ++i) g.col(i) = normal(p).cross(edge(p, i)) / (2 * rest_area);
    return g;
  }
  Hessian<3> hessian(const Points<3>& p) const {
    const Vector3 n = normal(p);
    Hessian<3> h;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const Real sign = j == i ? 0 : j == (i + 1) % 3 ? 1 : -1;
        h.block<3, 3>(3 * i, 3 * j) =
            (edge(p, i).dot(edge(p, j)) / (4 * area_of(p)) * n * n.transpose() - sign / 2 * cross_matrix(n)) /
            rest_area;
      }
    return h;
  }
};

// Points of well-shaped stencils, of any size.
template <int N>
Points<N> stencil(unsigned seed) {
  Random random(seed);
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  for (;;) {
    const Points<N> p = random.vectors<N>(N, 1);
    Real least = 1;
    if constexpr (N == 2) least = length_of(p);
    if constexpr (N == 3) least = area_of(p);
    if constexpr (N == 4) least = std::abs(volume_of(p));
    if (least > 0.05) return size * p;
  }
}

TEST(DifferentiatedConstraint, ReproducesLengthAreaAndVolume) {
  WorstError value, gradient, hessian;
  const auto compare = [&](unsigned seed, const auto& ours, const auto& closed_gradient, const auto& closed_hessian,
                           Real closed_value, const auto& p) {
    value.see(std::abs(ours.value(p) - closed_value) / (1 + std::abs(closed_value)), seed);
    gradient.see(relative_error(ours.gradient(p), closed_gradient), seed);
    hessian.see(relative_error(ours.hessian(p), closed_hessian), seed);
  };
  for (unsigned seed = 0; seed < 300; ++seed) {
    const Real size = stencil<2>(seed).norm();
    const Points<2> p2 = stencil<2>(seed + 1000) / stencil<2>(seed + 1000).norm() * size;
    const Length length = Length::at_rest(stencil<2>(seed));
    compare(seed, differentiated_constraint<2>(length_of, RestValue::relative).at_rest(stencil<2>(seed)),
            length.gradient(p2), length.hessian(p2), length.value(p2), p2);

    const Points<3> rest3 = stencil<3>(seed),
                    p3 = stencil<3>(seed + 1000) / stencil<3>(seed + 1000).norm() * rest3.norm();
    const ClosedArea area{area_of(rest3)};
    compare(seed, differentiated_constraint<3>(area_of, RestValue::relative).at_rest(rest3), area.gradient(p3),
            area.hessian(p3), area_of(p3) / area.rest_area - 1, p3);

    const Points<4> rest4 = stencil<4>(seed),
                    p4 = stencil<4>(seed + 1000) / stencil<4>(seed + 1000).norm() * rest4.norm();
    const TetrahedronVolume volume = TetrahedronVolume::at_rest(rest4);
    compare(seed, differentiated_constraint<4>(volume_of, RestValue::relative).at_rest(rest4), volume.gradient(p4),
            volume.hessian(p4), volume.value(p4), p4);
  }
  value.expect_below(1e-12, "value");
  gradient.expect_below(1e-12, "gradient");
  hessian.expect_below(1e-12, "hessian");
}

// What users write, each against differences of its own value and gradient.
template <int N, class Function>
void expect_differentiated(const char* what, const Function& f) {
  SCOPED_TRACE(what);
  WorstError gradient_error, hessian_error;
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Points<N> p = stencil<N>(seed).normalized() * 2;
    const auto kind = differentiated_constraint<N>(f).at_rest(p);
    Gradient<N> g;
    EXPECT_NEAR(kind.value_and_gradient(p, g), 0, 1e-14) << "seed " << seed;
    ASSERT_GT(g.norm(), 1e-3) << "seed " << seed;
    const auto value = [&](const Points<N>& q) { return kind.value(q); };
    const auto gradient = [&](const Points<N>& q) { return kind.gradient(q); };
    gradient_error.see((central_difference_gradient<N>(value, p, 1e-5) - g).norm() / (0.1 + g.norm()), seed);
    const Hessian<N> h = kind.hessian(p);
    EXPECT_EQ(h, h.transpose());
    hessian_error.see((central_difference_hessian<N>(gradient, p, 1e-5) - h).norm() / (0.1 + h.norm()), seed);
  }
  gradient_error.expect_below(1e-7, "gradient");
  hessian_error.expect_below(1e-7, "hessian");
}

TEST(DifferentiatedConstraint, TakesWhatUsersWrite) {
  const auto e = [](const auto& p) { return (p.col(1) - p.col(0)).eval(); };
  const auto f = [](const auto& p) { return (p.col(2) - p.col(0)).eval(); };
  expect_differentiated<3>("dot", [=](const auto& p) { return e(p).dot(f(p)); });
  expect_differentiated<3>("cross", [=](const auto& p) { return e(p).cross(f(p)).x() + 2 * e(p).cross(f(p)).z(); });
  expect_differentiated<3>("norm", [=](const auto& p) { return e(p).norm() + f(p).norm(); });
  expect_differentiated<3>("squaredNorm", [=](const auto& p) { return e(p).squaredNorm() - 3 * f(p).squaredNorm(); });
  expect_differentiated<3>("normalized", [=](const auto& p) { return e(p).normalized().dot(f(p)); });
  expect_differentiated<3>("sqrt", [=](const auto& p) { return sqrt(1 + e(p).squaredNorm()) - sqrt(f(p).norm()); });
  expect_differentiated<3>("atan2", [=](const auto& p) { return atan2(e(p).cross(f(p)).norm(), e(p).dot(f(p))); });
  expect_differentiated<3>("acos",
                           [=](const auto& p) { return acos(e(p).dot(f(p)) / (1.001 * e(p).norm() * f(p).norm())); });
  expect_differentiated<3>("asin",
                           [=](const auto& p) { return asin(0.9 * e(p).dot(f(p)) / (e(p).norm() * f(p).norm())); });
  expect_differentiated<3>("exp", [=](const auto& p) { return exp(-e(p).squaredNorm()) + exp(f(p).x()); });
  expect_differentiated<3>("log", [=](const auto& p) { return log(e(p).squaredNorm()) / 2.0; });
  expect_differentiated<3>("pow", [=](const auto& p) { return pow(e(p).squaredNorm(), 1.5) + pow(f(p).x(), 3); });
  expect_differentiated<3>("cbrt", [=](const auto& p) { return cbrt(e(p).squaredNorm()); });
  expect_differentiated<3>("sin and cos", [=](const auto& p) { return sin(e(p).x()) * cos(f(p).y()) + e(p).z(); });
  expect_differentiated<3>("tan", [=](const auto& p) { return tan(0.3 * e(p).x()); });
  expect_differentiated<3>("atan and tanh", [=](const auto& p) { return atan(e(p).x()) + tanh(f(p).y() - 1); });
  expect_differentiated<3>("hypot", [=](const auto& p) { return hypot(e(p).x(), f(p).y()); });
  expect_differentiated<3>("abs", [=](const auto& p) { return abs(e(p).x()) + abs(f(p).y() * f(p).z()); });
  expect_differentiated<3>("min and max", [=](const auto& p) {
    using std::min, std::max;
    return min(e(p).norm(), f(p).norm()) + 3 * max(e(p).squaredNorm(), f(p).squaredNorm());
  });
  expect_differentiated<3>("a branch", [=](const auto& p) {
    const auto x = e(p).x();
    return x > 0 ? 2 * x * x + x : x;
  });
  expect_differentiated<3>("division", [=](const auto& p) { return 1 / e(p).norm() + 2 / (1 + f(p).squaredNorm()); });
  expect_differentiated<3>("accumulation", [](const auto& p) {
    auto sum = p.col(0).squaredNorm();
    for (int k = 1; k < 3; ++k) sum += k * p.col(k).squaredNorm();
    sum -= 1;
    sum *= 2;
    sum /= p.col(0).norm() + 1;
    sum = sum * 3.0 - 1;
    return -sum;
  });
}

TEST(DifferentiatedConstraint, MixesWithFixedVectorsAndMatrices) {
  const Vector3 anchor(1, 2, 3);
  const Matrix3 metric = Vector3(1, 2, 5).asDiagonal();
  expect_differentiated<2>("a fixed point", [=](const auto& p) { return (p.col(0) - anchor).norm() + p(0, 1); });
  expect_differentiated<2>("a fixed direction",
                           [=](const auto& p) { return anchor.dot(p.col(0)) * p.col(1).dot(anchor); });
  expect_differentiated<2>("a fixed metric", [=](const auto& p) {
    const auto e = (p.col(1) - p.col(0)).eval();
    return e.dot(metric * e) / 2;
  });
  expect_differentiated<2>("scaled points", [](const auto& p) { return ((p * 0.5).col(0) - 2 * p.col(1) / 3).norm(); });
  expect_differentiated<3>("a mean", [](const auto& p) {
    const auto mean = p.rowwise().mean().eval();
    return (p.colwise() - mean).squaredNorm();
  });
  expect_differentiated<3>("a determinant", [](const auto& p) { return p.determinant(); });
}

TEST(DifferentiatedConstraint, ZeroIsTakenWhereThereIsNoDerivative) {
  const auto length = differentiated_constraint<2>(length_of).at_rest(stencil<2>(1));
  const Points<2> coincident = Points<2>::Ones();
  EXPECT_TRUE(length.gradient(coincident).isZero(0));
  EXPECT_TRUE(length.hessian(coincident).allFinite());
  const auto angle = differentiated_constraint<1>([](const auto& p) { return atan2(p(1), p(0)) + acos(1 + p(2)); });
  EXPECT_TRUE(angle.gradient(Points<1>::Zero()).isZero(0));
  EXPECT_TRUE(angle.hessian(Points<1>::Zero()).isZero(0));
}

constexpr auto perimeter = [](const auto& p) {
  auto sum = (p.col(0) - p.col(p.cols() - 1)).norm();
  for (Eigen::Index i = 1; i < p.cols(); ++i) sum += (p.col(i) - p.col(i - 1)).norm();
  return sum;
};

TEST(DifferentiatedConstraint, OfAnyNumberOfPointsIsThatOfAFixedNumber) {
  WorstError gradient, hessian;
  const auto compare = [&]<int n>(unsigned seed, std::integral_constant<int, n>) {
    const Points<n> p = Random(seed).vectors<n>(n, 1);
    const auto fixed = differentiated_constraint<n>(perimeter, RestValue::relative).at_rest(p);
    const auto any = differentiated_constraint<dynamic>(perimeter, RestValue::relative).at_rest(p);
    EXPECT_NEAR(any.value(2 * p), 1, 1e-14);
    gradient.see(relative_error(any.gradient(p), fixed.gradient(p)), seed);
    hessian.see(relative_error(any.hessian(p), fixed.hessian(p)), seed);
  };
  for (unsigned seed = 0; seed < 20; ++seed) {
    compare(seed, std::integral_constant<int, 3>{});
    compare(seed, std::integral_constant<int, 4>{});
    compare(seed, std::integral_constant<int, 5>{});
    compare(seed, std::integral_constant<int, 9>{});
  }
  gradient.expect_below(1e-15, "gradient");
  hessian.expect_below(1e-15, "hessian");
}

TEST(DifferenceConstraint, IsAccurateWhateverTheUnitOfLength) {
  WorstError error;
  for (unsigned seed = 0; seed < 300; ++seed) {
    const Points<3> rest = stencil<3>(seed);
    const Points<3> p = rest + 0.1 * rest.norm() * Random(seed).vectors<3>(3, 1);
    const auto kind = difference_constraint<3>(area_of, RestValue::relative).at_rest(rest);
    const auto exact = differentiated_constraint<3>(area_of, RestValue::relative).at_rest(rest);
    Gradient<3> g;
    EXPECT_EQ(kind.value_and_gradient(p, g), kind.value(p));
    error.see(relative_error(g, exact.gradient(p)), seed);
    const auto any = difference_constraint<dynamic>(area_of, RestValue::relative).at_rest(rest);
    EXPECT_LT(relative_error(any.gradient(p), g), 1e-15);
  }
  error.expect_below(1e-8, "gradient");
}

TEST(HandWrittenConstraint, IsWhatItIsGiven) {
  const Points<2> rest = stencil<2>(1), p = 2 * rest;
  const auto kind = user_constraint<2>(length_of, &gradient_of_length, RestValue::relative).at_rest(rest);
  EXPECT_NEAR(kind.value(p), 1, 1e-15);
  EXPECT_LT(relative_error(kind.gradient(p), Length::at_rest(rest).gradient(p)), 1e-15);
  const auto overwriting =
      user_constraint<2>(length_of, [](const Points<2>& q, Gradient<2>& g) { g = gradient_of_length(q); });
  EXPECT_EQ(overwriting.at_rest(rest).gradient(p), gradient_of_length(p));
}

TEST(UserConstraint, RestValueIsAsGivenSubtractedOrRelative) {
  Points<2> rest, p;
  rest << Vector3(0, 0, 0), Vector3(2, 0, 0);
  p << Vector3(0, 0, 0), Vector3(0, 5, 0);
  const auto value = [&](const auto& prototype) { return prototype.at_rest(rest).value(p); };
  EXPECT_DOUBLE_EQ(value(differentiated_constraint<2>(length_of)), 3);
  EXPECT_DOUBLE_EQ(value(differentiated_constraint<2>(length_of, RestValue::subtracted)), 3);
  EXPECT_DOUBLE_EQ(value(differentiated_constraint<2>(length_of, RestValue::as_given)), 5);
  EXPECT_DOUBLE_EQ(value(differentiated_constraint<2>(length_of, RestValue::relative)), 1.5);
  EXPECT_DOUBLE_EQ(differentiated_constraint<2>(length_of, RestValue::relative).at_rest(rest).hessian(p).norm(),
                   differentiated_constraint<2>(length_of).hessian(p).norm() / 2);
}

TEST(UserConstraint, RefusesRestValuesThatCannotBeAndSaysWhy) {
  const auto refusal = [](const auto& prototype, const Points<2>& rest) {
    return complaint<std::invalid_argument>([&] { prototype.at_rest(rest); });
  };
  const Points<2> coincident = Points<2>::Ones();
  EXPECT_EQ(refusal(differentiated_constraint<2>(length_of, RestValue::relative), coincident),
            "user constraint: relative to its value at rest, which is 0");
  Points<2> bad = stencil<2>(1);
  bad(1, 1) = std::numeric_limits<Real>::infinity();
  for (const RestValue mode : {RestValue::as_given, RestValue::subtracted})
    EXPECT_EQ(refusal(difference_constraint<2>(length_of, mode), bad), "user constraint: value at rest is inf");
  EXPECT_EQ(refusal(user_constraint<2>(length_of, &gradient_of_length, RestValue::relative), bad),
            "user constraint: relative to its value at rest, which is inf");
}

TEST(UserConstraint, CarriesWhatItsCallableCaptures) {
  const Vector3 ground(0, 0, 1);
  const auto prototype = differentiated_constraint<1>([ground](const auto& p) { return p.col(0).dot(ground); });
  std::vector<std::remove_const_t<decltype(prototype)>> many;
  many.reserve(10);
  for (int k = 0; k < 10; ++k) many.push_back(prototype.at_rest(Points<1>(0, 0, k)));
  for (int k = 0; k < 10; ++k) EXPECT_EQ(many[k].value(Points<1>(5, 5, 10)), 10 - k);
}

}  // namespace
}  // namespace penalty::testing
