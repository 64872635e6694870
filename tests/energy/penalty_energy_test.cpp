// The chain rule over every constraint of few points: energy, force, stiffness.
#include "penalty/energy/penalty_energy.h"

#include "kinds/samples.h"
#include "math/eigenvalues.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

template <class Kind>
class PenaltyEnergy : public ::testing::Test {
 protected:
  static constexpr int n = Kind::num_points;
};
TYPED_TEST_SUITE(PenaltyEnergy, ConstraintTypes);

// From a millijoule to 10 MJ.
template <class Kind>
Real stiffness_of(const Sample<Kind>& s) {
  return std::pow(10.0, static_cast<int>(s.seed % 11) - 3);
}

TYPED_TEST(PenaltyEnergy, IsQuadraticInCAndZeroAtRestOnly) {
  // K is the second derivative of the energy by C: along a line through the rest shape, E / C² is the same at every
  // point.
  int positive = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Real k = stiffness_of(s);
    EXPECT_LT(energy(s.kind, k, s.rest), 1e-28 * k);
    for (const Real share : {0.3, 1.0}) {
      const Points<TestFixture::n> p = s.rest + share * (s.points - s.rest);
      const Real c = s.kind.value(p);
      if (std::abs(c) < 1e-6) continue;
      EXPECT_NEAR(energy(s.kind, k, p) / (c * c), k / 2, 1e-12 * k);
      ++positive;
    }
  }
  EXPECT_GT(positive, static_cast<int>(num_samples));
}

TYPED_TEST(PenaltyEnergy, ForceIsMinusItsDerivative) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Real k = stiffness_of(s);
    const Gradient<TestFixture::n> f = force(s.kind, k, s.points);
    ASSERT_GT(f.norm() * s.size / k, 1e-6);
    const auto e = [&](const auto& p) { return energy(s.kind, k, p); };
    const Gradient<TestFixture::n> differences =
        -central_difference_gradient<TestFixture::n>(e, s.points, s.difference_step());
    // Near C = 0 the force is a small difference of large terms, so the error is measured against K |dC| too.
    error.see((f - differences).norm() / (f.norm() + 0.1 * k * s.kind.gradient(s.points).norm()), seed);
  }
  error.expect_below(1e-7, "relative error");
}

template <class Kind>
class InternalPenaltyForce : public PenaltyEnergy<Kind> {};
TYPED_TEST_SUITE(InternalPenaltyForce, InternalTypes);

TYPED_TEST(InternalPenaltyForce, HasNoNetForceAndNoNetTorque) {
  WorstError net, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Gradient<TestFixture::n> f = force(s.kind, stiffness_of(s), s.points);
    net.see(net_force<TestFixture::n>(f), seed);
    torque.see(net_torque<TestFixture::n>(s.points, f), seed);
  }
  net.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TYPED_TEST(PenaltyEnergy, ExactStiffnessIsMinusTheDerivativeOfTheForce) {
  if constexpr (!HasHessian<TypeParam>) return;  // Gauss-Newton's stands for it
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Real k = stiffness_of(s);
    const Hessian<TestFixture::n> exact = stiffness_matrix(s.kind, k, s.points, StiffnessModel::exact);
    ASSERT_GT(exact.norm() * s.size * s.size / k, 1e-3) << trace(s);
    const auto f = [&](const auto& p) -> Gradient<TestFixture::n> { return force(s.kind, k, p); };
    error.see(relative_error(-central_difference_hessian<TestFixture::n>(f, s.points, s.difference_step()), exact),
              seed);
  }
  error.expect_below(1e-6, "relative error");
}

TYPED_TEST(PenaltyEnergy, AtRestEveryStiffnessIsGaussNewtons) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Hessian<TestFixture::n> gauss_newton = stiffness_matrix(s.kind, 2, s.rest, StiffnessModel::gauss_newton);
    ASSERT_GT(gauss_newton.norm() * s.size * s.size, 0.01);
    EXPECT_LT(relative_error(stiffness_matrix(s.kind, 2, s.rest, StiffnessModel::exact), gauss_newton), 1e-13);
    EXPECT_LT(relative_error(stiffness_matrix(s.kind, 2, s.rest, StiffnessModel::psd_projected), gauss_newton), 1e-13);
  }
}

TYPED_TEST(PenaltyEnergy, GaussNewtonStiffnessResistsChangesOfCAlone) {
  // dxᵀ K dx = k (dC)², dC being what differences of C say; so it is of rank one, and never negative.
  WorstError error, negative;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Real k = stiffness_of(s), moment = 1e-6 * s.size;
    const Hessian<TestFixture::n> gauss_newton = stiffness_matrix(s.kind, k, s.points, StiffnessModel::gauss_newton);
    const Points<TestFixture::n> dx = Random(seed + 4000).vectors<TestFixture::n>(TestFixture::n, 1);
    const Real dc = (s.kind.value(s.points + moment * dx) - s.kind.value(s.points - moment * dx)) / (2 * moment);
    const Real work = dx.reshaped().dot(gauss_newton * dx.reshaped());
    error.see(std::abs(work - k * dc * dc) / (gauss_newton.norm() * dx.squaredNorm()), seed);
    negative.see(-smallest_eigenvalue(gauss_newton) / gauss_newton.norm(), seed);
  }
  error.expect_below(1e-8, "relative error");
  negative.expect_below(1e-14, "negative eigenvalue");
}

TYPED_TEST(PenaltyEnergy, ProjectedStiffnessIsTheNearestPositiveSemidefiniteOne) {
  WorstError error;
  int indefinite = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Real k = stiffness_of(s);
    const Hessian<TestFixture::n> exact = stiffness_matrix(s.kind, k, s.points, StiffnessModel::exact);
    const Hessian<TestFixture::n> projected = stiffness_matrix(s.kind, k, s.points, StiffnessModel::psd_projected);
    const Hessian<TestFixture::n> added = projected - exact;
    indefinite += added.norm() > 1e-3 * exact.norm();
    error.see(-smallest_eigenvalue(projected) / exact.norm(), seed);
    error.see(-smallest_eigenvalue(added) / exact.norm(), seed);
    error.see(std::abs(projected.cwiseProduct(added).sum()) / exact.squaredNorm(), seed);
  }
  if constexpr (HasHessian<TypeParam>) {
    EXPECT_GT(indefinite, 50);
  }
  error.expect_below(1e-13, "optimality conditions");
}

TYPED_TEST(PenaltyEnergy, DegenerateStencilsAreFinite) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    for (const Points<TestFixture::n>& points : degenerate_points<TestFixture::n>(TestFixture::n, s.size)) {
      EXPECT_TRUE(std::isfinite(energy(s.kind, 2, points))) << points;
      EXPECT_TRUE(force(s.kind, 2, points).allFinite()) << points;
      for (const auto model : {StiffnessModel::gauss_newton, StiffnessModel::exact, StiffnessModel::psd_projected})
        EXPECT_TRUE(stiffness_matrix(s.kind, 2, points, model).allFinite()) << points;
    }
  }
}

}  // namespace
}  // namespace penalty::testing
