#include "penalty/kinds/stable_neo_hookean.h"

#include <Eigen/LU>
#include <array>
#include <limits>

#include "kinds/samples.h"
#include "math/eigenvalues.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

static_assert(ElasticEnergy<StableNeoHookean>);

constexpr std::array<Real, 5> ratios{0, 0.5, 1, 4, 49};  // lambda / mu

struct Element {
  Sample<TetrahedronVolume> s;
  StableNeoHookean kind;
};

// The shapes of tetrahedra that the volume is tested with, of all ratios.
Element element(unsigned seed) {
  const auto s = sample<TetrahedronVolume>(seed);
  return {s, StableNeoHookean::with_ratio(ratios[seed / num_shapes % ratios.size()]).at_rest(s.rest)};
}

// D0 is the identity, so F = 1 + H takes the points to (0, columns of F).
Points<4> unit_corner() {
  Points<4> p = Points<4>::Zero();
  p.rightCols<3>().setIdentity();
  return p;
}
StableNeoHookean unit(Real ratio) { return StableNeoHookean::with_ratio(ratio).at_rest(unit_corner()); }

// psi as printed: of F alone, in units of mu.
Real printed_psi(const Matrix3& f, Real ratio) {
  const Real m = 4.0 / 3, l = ratio + 5.0 / 6, alpha = 1 + 3 * m / (4 * l);
  const Real i = f.squaredNorm(), j = f.determinant();
  return m / 2 * (i - 3) - m / 2 * std::log((i + 1) / 4) +
         l / 2 * ((j - alpha) * (j - alpha) - (1 - alpha) * (1 - alpha));
}

TEST(StableNeoHookean, IsThePrintedEnergy) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    const Matrix3 now = s.points.rightCols<3>().colwise() - s.points.col(0);
    const Matrix3 rest = s.rest.rightCols<3>().colwise() - s.rest.col(0);
    const Real expected = printed_psi(now * rest.inverse(), kind.lambda_over_mu);
    ASSERT_GT(expected, 1e-6) << trace(s);
    error.see(std::abs(kind.energy(s.points) - expected) / (1 + expected), seed);
  }
  error.expect_below(1e-12, "relative error");
}

TEST(StableNeoHookean, GradientIsTheDerivativeOfTheEnergy) {
  WorstError error, together;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    SCOPED_TRACE(trace(s));
    Gradient<4> gradient = Gradient<4>::Constant(std::numeric_limits<Real>::quiet_NaN());
    const Real energy = kind.energy_and_gradient(s.points, gradient);
    ASSERT_GT(gradient.norm() * s.size, 0.01);
    together.see(std::abs(energy - kind.energy(s.points)) / (1 + energy), seed);
    const auto value = [&material = kind](const Points<4>& p) { return material.energy(p); };
    error.see(relative_error(central_difference_gradient<4>(value, s.points, s.difference_step()), gradient), seed);
  }
  error.expect_below(1e-7, "relative error");
  together.expect_below(1e-14, "energy with and without gradient");
}

TEST(StableNeoHookean, HessianIsTheDerivativeOfTheGradient) {
  WorstError error, asymmetry;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    const Hessian<4> hessian = kind.energy_hessian(s.points);
    ASSERT_GT(hessian.norm() * s.size * s.size, 0.01) << trace(s);
    const auto gradient = [&material = kind](const Points<4>& p) {
      Gradient<4> g;
      material.energy_and_gradient(p, g);
      return g;
    };
    error.see(relative_error(central_difference_hessian<4>(gradient, s.points, s.difference_step()), hessian), seed);
    asymmetry.see(relative_error(hessian.transpose(), hessian), seed);
  }
  error.expect_below(1e-7, "relative error");
  asymmetry.expect_below(1e-15, "asymmetry");
}

TEST(StableNeoHookean, HasNoNetForceAndNoNetTorque) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    Gradient<4> gradient;
    kind.energy_and_gradient(s.points, gradient);
    force.see(net_force<4>(gradient), seed);
    torque.see(net_torque<4>(s.points, gradient), seed);
  }
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TEST(StableNeoHookean, DoesNotDependOnPlaceOrientationOrUnit) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    Random random(seed + 1000);
    const Real energy = kind.energy(s.points);
    const Points<4> moved = (random.rotation() * s.points).colwise() + random.vector(2 * s.size);
    error.see(std::abs(kind.energy(moved) - energy) / (1 + energy), seed);
    const auto in_millimetres = StableNeoHookean::with_ratio(kind.lambda_over_mu).at_rest(1e3 * s.rest);
    error.see(std::abs(in_millimetres.energy(1e3 * s.points) - energy) / (1 + energy), seed);
    // The mirror image of both.
    const Matrix3 mirror = Vector3(1, 1, -1).asDiagonal();
    const auto mirrored = StableNeoHookean::with_ratio(kind.lambda_over_mu).at_rest(mirror * s.rest);
    error.see(std::abs(mirrored.energy(mirror * s.points) - energy) / (1 + energy), seed);
  }
  error.expect_below(1e-12, "relative error");
}

TEST(StableNeoHookean, RestIsTheStrictMinimumUpToRigidMotion) {
  int checked = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const auto [s, kind] = element(seed);
    SCOPED_TRACE(trace(s));
    Random random(seed + 1000);
    const Points<4> moved = (random.rotation() * s.rest).colwise() + random.vector(s.size);
    Gradient<4> gradient;
    const Hessian<4> hessian = kind.energy_hessian(moved);
    EXPECT_LT(kind.energy_and_gradient(moved, gradient), 1e-14 * (1 + kind.lambda_over_mu));
    EXPECT_LT(gradient.norm(), 1e-12 * hessian.norm() * s.size);
    // Six rigid motions without stiffness, the six others with.
    const Eigen::VectorXd eigenvalues = symmetric_eigenvalues(hessian);
    EXPECT_LT(eigenvalues.head<6>().cwiseAbs().maxCoeff(), 1e-12 * eigenvalues[11]);
    EXPECT_GT(eigenvalues[6], 1e-6 * eigenvalues[11]);
    ++checked;
  }
  EXPECT_EQ(checked, 100);
}

TEST(StableNeoHookean, IsNowhereNegative) {
  // Of any F, inverted and collapsed ones too; psi depends on the signed singular values only, so diagonal F will do.
  for (const Real ratio : ratios) {
    const StableNeoHookean kind = unit(ratio);
    Real least = std::numeric_limits<Real>::infinity();
    for (Real x = -3; x < 3.05; x += 0.1)
      for (Real y = -3; y < 3.05; y += 0.1)
        for (Real z = -3; z < 3.05; z += 0.1) {
          Points<4> p = Points<4>::Zero();
          p.rightCols<3>() = Vector3(x, y, z).asDiagonal();
          const Real psi = printed_psi(p.rightCols<3>(), ratio);
          // Turned by half a turn about an axis it is at rest as well.
          const bool at_rest = std::abs(std::abs(x) - 1) < 0.05 && std::abs(std::abs(y) - 1) < 0.05 &&
                               std::abs(std::abs(z) - 1) < 0.05 && x * y * z > 0;
          if (!at_rest) least = std::min(least, psi);
          ASSERT_GE(kind.energy(p), 0);
          ASSERT_NEAR(kind.energy(p), psi, 1e-12 * (1 + psi));
        }
    EXPECT_GT(least, 0.005) << "lambda/mu " << ratio;
  }
}

TEST(StableNeoHookean, SmallEnergiesAreNotLostInRoundOff) {
  // Uniform growth by e: psi = 3 (1 + 3/2 lambda/mu) e² + O(e³), far below the terms that it is made of.
  for (const Real ratio : ratios)
    for (const Real e : {1e-3, 1e-5, 1e-7}) {
      const Real expected = (3 + 4.5 * ratio) * e * e;
      EXPECT_NEAR(unit(ratio).energy((1 + e) * unit_corner()) / expected, 1, 5 * e + 1e-8) << ratio << ' ' << e;
    }
}

TEST(StableNeoHookean, AtRestItIsLinearElasticityWithItsLameParameters) {
  // psi'' in the direction of a displacement gradient H with strain e: 2 e:e + lambda/mu tr(e)², for any rest shape.
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    Matrix3 h = Random(seed + 1000).vectors<3>(3, 1);
    if (seed % 3 == 0) h = Vector3(1, 0, 0) * Vector3(1, 0, 0).transpose();  // uniaxial
    if (seed % 3 == 1) h = Vector3(1, 0, 0) * Vector3(0, 1, 0).transpose();  // simple shear
    const Matrix3 strain = (h + h.transpose()) / 2;
    const Points<4> displacement = h * s.rest;
    const Real expected = 2 * strain.squaredNorm() + kind.lambda_over_mu * strain.trace() * strain.trace();
    const Real actual = displacement.reshaped().dot(kind.energy_hessian(s.rest) * displacement.reshaped());
    error.see(std::abs(actual / expected - 1), seed);
  }
  error.expect_below(1e-11, "relative error of the strain energy");
}

TEST(StableNeoHookean, AStretchedBarThinsByPoissonsRatio) {
  // F = diag(1 + e, 1 + t, 1 + t) with no force across: t = -nu e, and the force along is E e, E/mu = 2 (1 + nu).
  const Real e = 1e-6;
  for (const Real nu : {0.0, 0.1, 0.25, 0.4, 0.49}) {
    SCOPED_TRACE("Poisson's ratio " + std::to_string(nu));
    const StableNeoHookean kind = unit(2 * nu / (1 - 2 * nu));
    const auto forces = [&](Real t) -> Vector3 {
      Points<4> p = Points<4>::Zero();
      p.rightCols<3>() = Vector3(1 + e, 1 + t, 1 + t).asDiagonal();
      Gradient<4> g;
      kind.energy_and_gradient(p, g);
      return {g(0, 1), g(1, 2), g(2, 3)};
    };
    Real low = -e, high = e;
    ASSERT_LT(forces(low)[1] * forces(high)[1], 0);
    for (int k = 0; k < 60; ++k) (forces((low + high) / 2)[1] < 0 ? low : high) = (low + high) / 2;
    EXPECT_NEAR(-low / e, nu, 1e-5);
    EXPECT_NEAR(forces(low)[0] / e, 2 * (1 + nu), 1e-4);
  }
}

TEST(StableNeoHookean, ACollapsedElementHasAWayOut) {
  // At F = 0 gradient and Hessian are zero: a stationary point. psi(t 1) - psi(0) = -(l + 1) t³ + O(t⁴): it is no
  // minimum.
  for (const Real ratio : ratios) {
    SCOPED_TRACE("lambda/mu " + std::to_string(ratio));
    const StableNeoHookean kind = unit(ratio);
    const Points<4> collapsed = Points<4>::Ones();
    Gradient<4> gradient;
    const Real energy = kind.energy_and_gradient(collapsed, gradient);
    EXPECT_EQ(energy, kind.energy(Points<4>::Zero()));
    EXPECT_TRUE(gradient.isZero(0));
    EXPECT_TRUE(kind.energy_hessian(collapsed).isZero(1e-15));
    const Real t = 1e-3, cube = (ratio + 5.0 / 6 + 1) * t * t * t;
    EXPECT_NEAR(kind.energy(t * unit_corner()) - energy, -cube, 0.01 * cube);
    // Without the logarithm, m/2 I would dominate: the gradient grows slower than F itself.
    kind.energy_and_gradient(t * unit_corner(), gradient);
    EXPECT_LT(gradient.rightCols<3>().trace(), 0);
    EXPECT_LT(gradient.norm(), 10 * (1 + ratio) * t * t);
  }
}

TEST(StableNeoHookean, AnInvertedElementIsPulledBackThroughFlat) {
  for (const Real ratio : ratios) {
    const StableNeoHookean kind = unit(ratio);
    for (const Real height : {-1.0, -0.5, -0.1, 0.0, 0.1, 0.9}) {
      Points<4> p = unit_corner();
      p(2, 3) = height;
      Gradient<4> gradient;
      kind.energy_and_gradient(p, gradient);
      EXPECT_LT(gradient(2, 3), -0.01) << "lambda/mu " << ratio << ", height " << height;
    }
  }
}

TEST(StableNeoHookean, DegenerateStencilsAreFinite) {
  for (unsigned seed = 0; seed < 25; ++seed) {
    const auto [s, kind] = element(seed);
    for (const Points<4>& points : degenerate_points<4>(4, s.size)) {
      Gradient<4> gradient;
      EXPECT_TRUE(std::isfinite(kind.energy_and_gradient(points, gradient))) << points;
      EXPECT_TRUE(gradient.allFinite()) << points;
      EXPECT_TRUE(kind.energy_hessian(points).allFinite()) << points;
      kind.visit_damping_modes(points, [&](Real, const Gradient<4>& g) { EXPECT_TRUE(g.allFinite()) << points; });
    }
  }
}

TEST(StableNeoHookeanDamping, ModesAreTheLengthsOfTheEdgesAndTheVolume) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    SCOPED_TRACE(trace(s));
    std::vector<Real> weights;
    std::vector<Gradient<4>> modes;
    kind.visit_damping_modes(s.points, [&](Real weight, const Gradient<4>& g) {
      weights.push_back(weight);
      modes.push_back(g);
    });
    std::size_t k = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j, ++k) {
        Points<2> rest, points;
        rest << s.rest.col(i), s.rest.col(j);
        points << s.points.col(i), s.points.col(j);
        const Gradient<2> g = Length::at_rest(rest).gradient(points);
        Gradient<4> expected = Gradient<4>::Zero();
        expected.col(i) = g.col(0);
        expected.col(j) = g.col(1);
        ASSERT_LT(k, modes.size());
        EXPECT_EQ(weights[k], 2.5);
        error.see(relative_error(modes[k], expected), seed);
      }
    const bool has_volume = kind.lambda_over_mu > 1;
    ASSERT_EQ(modes.size(), has_volume ? 7u : 6u);
    if (!has_volume) continue;
    EXPECT_EQ(weights[6], kind.lambda_over_mu - 1);
    error.see(relative_error(modes[6], TetrahedronVolume::at_rest(s.rest).gradient(s.points)), seed);
  }
  error.expect_below(1e-12, "relative error");
}

Matrix3 uniform_rotation(Random& random) {
  Eigen::Vector<Real, 4> q;
  do
    for (Real& x : q) x = random.uniform(-1, 1);
  while (q.norm() > 1 || q.norm() < 0.1);
  return Eigen::Quaternion<Real>(q.normalized()).toRotationMatrix();
}

TEST(StableNeoHookeanDamping, AveragesOverDirectionsToTheModuli) {
  // Under a strain rate e the modes of the regular tetrahedron, turned every way, dissipate 2 e:e + lambda/mu tr(e)².
  Points<4> regular;
  regular << Vector3(1, 1, 1), Vector3(-1, 1, -1), Vector3(1, -1, -1), Vector3(-1, -1, 1);
  Matrix3 rate;
  rate << 0.3, 0.1, -0.4, 0.1, 0.5, 0.2, -0.4, 0.2, -0.1;
  for (const Real ratio : {1.0, 4.0}) {
    const StableNeoHookean prototype = StableNeoHookean::with_ratio(ratio);
    const Real expected = 2 * rate.squaredNorm() + ratio * rate.trace() * rate.trace();
    Random random(5);
    const int turns = 40000;
    Real sum = 0;
    for (int k = 0; k < turns; ++k) {
      const Points<4> rest = uniform_rotation(random) * regular, velocities = rate * rest;
      prototype.at_rest(rest).visit_damping_modes(rest, [&](Real weight, const Gradient<4>& g) {
        const Real speed = g.cwiseProduct(velocities).sum();
        sum += weight * speed * speed;
      });
    }
    EXPECT_NEAR(sum / turns / expected, 1, 0.01) << "lambda/mu " << ratio;
  }
}

TEST(StableNeoHookeanDamping, EveryModeKeepsLinearAndAngularMomentum) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto [s, kind] = element(seed);
    const Points<4>& points = s.points;
    kind.visit_damping_modes(points, [&](Real, const Gradient<4>& g) {
      force.see(net_force<4>(g), seed);
      torque.see(net_torque<4>(points, g), seed);
    });
  }
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TEST(StableNeoHookeanDamping, CoincidentPointsHaveTheDirectionAtRest) {
  const StableNeoHookean kind = unit(1);
  Points<4> p = unit_corner();
  p.col(1) = p.col(0);
  int modes = 0;
  kind.visit_damping_modes(p, [&](Real, const Gradient<4>& g) {
    if (modes++ != 0) return;
    EXPECT_LT((g.col(1) - Vector3(1, 0, 0)).norm(), 1e-15);
    EXPECT_EQ(g.col(0), -g.col(1));
  });
  EXPECT_EQ(modes, 6);
}

TEST(StableNeoHookean, RefusesFlatRestShapesAndImpossibleRatiosByName) {
  const auto refusal = [](const auto& make) { return complaint<std::invalid_argument>(make); };
  const Real infinity = std::numeric_limits<Real>::infinity(), nan = std::numeric_limits<Real>::quiet_NaN();
  Points<4> flat = unit_corner();
  flat.col(3) << 1, 1, 0;
  EXPECT_EQ(refusal([&] { StableNeoHookean::with_ratio(1).at_rest(flat); }), "stable neo-Hookean: rest volume is 0");
  for (const Real bad : {nan, infinity}) {
    Points<4> rest = unit_corner();
    rest(1, 2) = bad;
    const std::string message = refusal([&] { StableNeoHookean::with_ratio(1).at_rest(rest); });
    EXPECT_TRUE(message.starts_with("stable neo-Hookean: rest volume is ")) << message;
  }
  EXPECT_EQ(refusal([] { StableNeoHookean::with_ratio(-0.5); }),
            "stable neo-Hookean: lambda/mu is -0.5, must be zero or positive and finite");
  EXPECT_EQ(refusal([&] { StableNeoHookean::with_ratio(nan); }),
            "stable neo-Hookean: lambda/mu is nan, must be zero or positive and finite");
  EXPECT_EQ(refusal([&] { StableNeoHookean::with_ratio(infinity); }),
            "stable neo-Hookean: lambda/mu is inf, must be zero or positive and finite");
  StableNeoHookean changed = StableNeoHookean::with_ratio(1);
  changed.lambda_over_mu = -1;
  EXPECT_EQ(refusal([&] { changed.at_rest(unit_corner()); }),
            "stable neo-Hookean: lambda/mu is -1, must be zero or positive and finite");
}

}  // namespace
}  // namespace penalty::testing
