#include "penalty/math/finite_difference.h"

#include "math/random.h"

namespace penalty::testing {
namespace {

// f = 1/2 pᵀ A p + b . p, with gradient A p + b and Hessian A.
struct Quadratic {
  Hessian<2> a;
  Eigen::Matrix<Real, 6, 1> b;

  explicit Quadratic(Random& random) {
    for (Real& entry : a.reshaped()) entry = random.uniform(-1, 1);
    a = (a + a.transpose()).eval();
    for (Real& entry : b) entry = random.uniform(-1, 1);
  }
  Real value(const Points<2>& p) const { return p.reshaped().dot(a * p.reshaped()) / 2 + b.dot(p.reshaped()); }
  Gradient<2> gradient(const Points<2>& p) const { return (a * p.reshaped() + b).reshaped(3, 2); }
};

TEST(CentralDifferences, AreExactForQuadraticsWhateverTheStep) {
  WorstError gradient_error, hessian_error;
  for (unsigned seed = 0; seed < 50; ++seed) {
    Random random(seed);
    const Quadratic f(random);
    const Points<2> p = random.vectors<2>(2, 1);
    for (const Real step : {0.125, 2.0}) {
      const auto value = [&](const Points<2>& q) { return f.value(q); };
      const auto gradient = [&](const Points<2>& q) { return f.gradient(q); };
      ASSERT_GT(f.gradient(p).norm(), 0);
      gradient_error.see(relative_error(central_difference_gradient<2>(value, p, step), f.gradient(p)), seed);
      hessian_error.see(relative_error(central_difference_hessian<2>(gradient, p, step), f.a), seed);
    }
  }
  gradient_error.expect_below(1e-13, "gradient");
  hessian_error.expect_below(1e-13, "hessian");
}

TEST(CentralDifferences, AreOfSecondOrder) {
  // f = x³ at x = 1: (f(1 + h) - f(1 - h)) / 2h = 3 + h².
  const auto cube = [](const Points<1>& p) { return p(0) * p(0) * p(0); };
  const Points<1> p(1, 0, 0);
  for (const Real step : {0.5, 0.25, 0.125}) {
    EXPECT_EQ(central_difference_gradient<1>(cube, p, step)(0), 3 + step * step);
    EXPECT_EQ(central_difference_gradient<1>(cube, p, step)(1), 0);
  }
}

TEST(CentralDifferences, HessianColumnsBelongToTheCoordinateThatMoved) {
  // g = (p_y, 0, 0): d g_x / d y = 1 is entry (0, 1) and there is no mirror image of it.
  const auto shear = [](const Points<1>& p) { return Gradient<1>(p(1), 0, 0); };
  Hessian<1> expected = Hessian<1>::Zero();
  expected(0, 1) = 1;
  EXPECT_EQ(central_difference_hessian<1>(shear, Points<1>(1, 2, 3), 0.25), expected);
}

}  // namespace
}  // namespace penalty::testing
