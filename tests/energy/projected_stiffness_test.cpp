// The kinds that bodies are made of have their projected stiffness in closed form: it obeys the laws of the projection.
#include <array>

#include "kinds/samples.h"
#include "math/allocations.h"
#include "math/eigenvalues.h"
#include "penalty/energy/penalty_energy.h"
#include "penalty/kinds/stable_neo_hookean.h"

namespace penalty::testing {
namespace {

static_assert(HasProjectedStiffness<Length> && HasProjectedStiffness<TetrahedronVolume>);
static_assert(HasProjectedHessian<StableNeoHookean>);

constexpr unsigned num_rests = 200;

template <class Kind>
Kind at_rest(const Points<Kind::num_points>& rest, unsigned seed) {
  constexpr std::array<Real, 4> ratios{0, 1, 4, 49};
  if constexpr (std::same_as<Kind, StableNeoHookean>)
    return StableNeoHookean::with_ratio(ratios[seed % ratios.size()]).at_rest(rest);
  else
    return Kind::at_rest(rest);
}

template <int N>
Points<N> rest_points(Random& random) {
  return well_shaped_points<std::conditional_t<N == 2, Length, TetrahedronVolume>>(random);
}

// Calls visit(kind, points, seed) for elements of 1e-6 to 1e6 metres, turned, in every kind of shape.
template <class Kind, class Visit>
void visit_elements(const Visit& visit) {
  constexpr int n = Kind::num_points;
  for (unsigned seed = 0; seed < num_rests; ++seed) {
    Random random(seed);
    const Points<n> rest = rest_points<n>(random);
    const Real unit = std::pow(10.0, random.uniform(-6, 6));
    const Kind kind = at_rest<Kind>(unit * rest, seed);
    const Vector3 axis = random.direction();
    const auto along_axis = [&](Real factor) -> Points<n> {
      return (Matrix3::Identity() + (factor - 1) * axis * axis.transpose()) * rest;
    };
    const Points<n> noise = random.vectors<n>(n, 1);
    for (const Points<n>& shape :
         {rest, Points<n>(rest + 0.02 * noise), Points<n>(rest + 0.3 * noise), noise, Points<n>(1.1 * rest),
          Points<n>(0.7 * rest), Points<n>(3 * rest), along_axis(2), along_axis(0.5), along_axis(1e-3),
          along_axis(1e-9), along_axis(0), along_axis(-1), Points<n>(along_axis(-0.1) + 0.1 * noise), Points<n>(-rest),
          Points<n>(axis * (axis.transpose() * rest)), Points<n>(1e-5 * rest), Points<n>(1e-10 * rest),
          Points<n>(Points<n>::Zero())}) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      visit(kind, Points<n>(unit * (random.rotation() * shape)), seed);
    }
    visit(kind, Points<n>(unit * Points<n>::Constant(0.3)), seed);
  }
}

template <class Kind>
class ProjectedStiffness : public ::testing::Test {};
using ClosedForms = ::testing::Types<Length, TetrahedronVolume, StableNeoHookean>;
TYPED_TEST_SUITE(ProjectedStiffness, ClosedForms);

TYPED_TEST(ProjectedStiffness, IsPositiveSemidefiniteAndNoLessThanTheExactOne) {
  constexpr int n = TypeParam::num_points;
  WorstError negative, below, asymmetry;
  int indefinite = 0, elements = 0;
  visit_elements<TypeParam>([&](const TypeParam& kind, const Points<n>& points, unsigned seed) {
    const Hessian<n> exact = stiffness_matrix(kind, 3, points, StiffnessModel::exact);
    const Hessian<n> projected = stiffness_matrix(kind, 3, points, StiffnessModel::psd_projected);
    ++elements;
    if (exact.isZero(0)) {
      EXPECT_TRUE(projected.isZero(0));
      return;
    }
    indefinite += smallest_eigenvalue(exact) < -1e-3 * exact.norm();
    negative.see(-smallest_eigenvalue(projected) / exact.norm(), seed);
    below.see(-smallest_eigenvalue(projected - exact) / exact.norm(), seed);
    asymmetry.see((projected - projected.transpose()).norm() / exact.norm(), seed);
  });
  EXPECT_EQ(elements, static_cast<int>(20 * num_rests));
  EXPECT_GT(indefinite, elements / 10);
  negative.expect_below(1e-13, "negative eigenvalue");
  below.expect_below(1e-13, "eigenvalue below the exact one");
  asymmetry.expect_below(1e-300, "asymmetry");
}

// The neo-Hookean material is projected in F instead.
template <class Kind>
class ProjectedStiffnessOfAConstraint : public ::testing::Test {};
using ConstraintsInClosedForm = ::testing::Types<Length, TetrahedronVolume>;
TYPED_TEST_SUITE(ProjectedStiffnessOfAConstraint, ConstraintsInClosedForm);

TYPED_TEST(ProjectedStiffnessOfAConstraint, IsTheNearest) {
  constexpr int n = TypeParam::num_points;
  WorstError error;
  for (const Profile& profile : {Profile{}, Profile{.target = 0.4}, Profile{.target = -1.5}, Profile{0, -0.2, 0.1}})
    visit_elements<TypeParam>([&](const TypeParam& kind, const Points<n>& points, unsigned seed) {
      const Hessian<n> exact = stiffness_matrix(kind, 3, points, StiffnessModel::exact, profile);
      const Hessian<n> projected = stiffness_matrix(kind, 3, points, StiffnessModel::psd_projected, profile);
      if (exact.isZero(0))
        EXPECT_TRUE(projected.isZero(0));
      else
        error.see((projected - psd_projection(exact)).norm() / exact.norm(), seed);
    });
  error.expect_below(1e-12, "relative error");
}

TYPED_TEST(ProjectedStiffness, AllocatesNothing) {
  constexpr int n = TypeParam::num_points;
  const Points<n> rest = Random(1).vectors<n>(n, 1);
  const TypeParam kind = at_rest<TypeParam>(rest, 1);
  for (const Points<n>& points : {rest, Points<n>(-0.5 * rest), Points<n>(Points<n>::Zero())}) {
    const long before = num_allocations;
    const Real entry = stiffness_matrix(kind, 3, points, StiffnessModel::psd_projected)(0, 0);
    EXPECT_EQ(num_allocations - before, 0);
    EXPECT_GE(entry, 0);
  }
}

// d²psi/dF² of the material is that of the element whose edges are F and whose rest shape is the identity.
using FHessian = Eigen::Matrix<Real, 9, 9>;
FHessian material_hessian(const StableNeoHookean& element, const Points<4>& points) {
  StableNeoHookean unit = element;
  unit.inverse_rest.setIdentity();
  Points<4> p = Points<4>::Zero();
  p.rightCols<3>() = (points.rightCols<3>().colwise() - points.col(0)) * element.inverse_rest;
  return unit.energy_hessian(p).bottomRightCorner<9, 9>();
}

TEST(ProjectedNeoHookean, IsTheNearestOneInF) {
  WorstError error;
  visit_elements<StableNeoHookean>([&](const StableNeoHookean& kind, const Points<4>& points, unsigned seed) {
    Eigen::Matrix<Real, 9, 9> to_points = Eigen::Matrix<Real, 9, 9>::Zero();  // dF/d[p1, p2, p3]
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) to_points.block<3, 3>(3 * a, 3 * k).diagonal().setConstant(kind.inverse_rest(a, k));
    const FHessian exact = material_hessian(kind, points);
    const FHessian expected = to_points * psd_projection<9>(exact) * to_points.transpose();
    const Hessian<4> projected = stiffness_matrix(kind, 1, points, StiffnessModel::psd_projected);
    const Real scale = exact.norm() * to_points.squaredNorm();
    if (scale > 0) error.see((projected.bottomRightCorner<9, 9>() - expected).norm() / scale, seed);
  });
  error.expect_below(1e-13, "relative error");
}

TEST(ProjectedNeoHookean, IsTheExactOneWhereThatIsPositiveSemidefinite) {
  WorstError error;
  int checked = 0;
  for (unsigned seed = 0; seed < num_rests; ++seed) {
    Random random(seed);
    const Points<4> rest = rest_points<4>(random);
    const auto kind = at_rest<StableNeoHookean>(rest, seed);
    // At the volume J = alpha = 1 + 1/l only the stretch term is left, which is positive; and close to it.
    const Real growth = std::cbrt(1 + 1 / (kind.lambda_over_mu + 5.0 / 6));
    Points<4> points = growth * (random.rotation() * rest);
    points += random.vectors<4>(4, 1e-3);
    const Hessian<4> exact = stiffness_matrix(kind, 3, points, StiffnessModel::exact);
    if (smallest_eigenvalue(exact) < -1e-14 * exact.norm()) continue;
    ++checked;
    for (const auto model : {StiffnessModel::psd_projected, StiffnessModel::gauss_newton, StiffnessModel::taut})
      error.see(relative_error(stiffness_matrix(kind, 3, points, model), exact), seed);
  }
  EXPECT_GT(checked, static_cast<int>(num_rests) / 2);
  error.expect_below(1e-13, "relative error");
}

TEST(ProjectedNeoHookean, UnderAProfileIsProjectedInThePoints) {
  WorstError error;
  const Profile profile{0, 0, 0.2};
  visit_elements<StableNeoHookean>([&](const StableNeoHookean& kind, const Points<4>& points, unsigned seed) {
    const Hessian<4> exact = stiffness_matrix(kind, 3, points, StiffnessModel::exact, profile);
    const Hessian<4> projected = stiffness_matrix(kind, 3, points, StiffnessModel::psd_projected, profile);
    if (!exact.isZero(0)) error.see((projected - psd_projection(exact)).norm() / exact.norm(), seed);
    EXPECT_EQ(stiffness_matrix(kind, 3, points, StiffnessModel::taut, profile),
              stiffness_matrix(kind, 3, points, StiffnessModel::psd_projected));
  });
  error.expect_below(1e-14, "relative error");
}

}  // namespace
}  // namespace penalty::testing
