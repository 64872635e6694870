// A batch is its elements: every function of it against the functions of one element, over every kind.
#include "penalty/fields/batch_loops.h"

#include <limits>

#include "fields/meshes.h"
#include "kinds/samples.h"

namespace penalty::testing {
namespace {

// Elements between random particles, several at each, with stiffnesses of many sizes.
template <Constraint Kind>
struct Cloud {
  static constexpr int n = Kind::num_points;
  static constexpr int num_particles = 12, num_elements = 30;

  std::unique_ptr<Batch<Kind>> made = make_batch<Kind>(num_particles);
  Batch<Kind>& batch = *made;
  PackedVectors x, v;
  std::vector<Real> inverse_masses;

  explicit Cloud(unsigned seed) {
    Random random(seed);
    for (int e = 0; e < num_elements; ++e) {
      std::array<int, n> stencil;
      for (int k = 0; k < n; ++k) {
        bool is_new = false;
        while (!is_new) {
          stencil[k] = static_cast<int>(random.index(num_particles));
          is_new = std::find(stencil.begin(), stencil.begin() + k, stencil[k]) == stencil.begin() + k;
        }
      }
      batch.add(stencil, Kind::at_rest(well_shaped_points<Kind>(random)), std::pow(10.0, random.uniform(-2, 2)));
    }
    x = random_packed(num_particles, 1, random);
    v = random_packed(num_particles, 1, random);
    inverse_masses = random_inverse_masses(num_particles, random);
    inverse_masses[3] = 0;
  }

  Points<n> points_of(int e, const PackedVectors& vectors) const {
    Points<n> points;
    for (int k = 0; k < n; ++k) points.col(k) = vectors.col(batch.stencils()[e][k]).template head<3>();
    return points;
  }

  // The sum over the elements of what `element(e)` gives each of its points.
  template <class Element>
  PackedVectors sum(const Element& element) const {
    PackedVectors total = PackedVectors::Zero(4, num_particles);
    for (int e = 0; e < num_elements; ++e) {
      const Gradient<n> values = element(e);
      for (int k = 0; k < n; ++k) total.col(batch.stencils()[e][k]).template head<3>() += values.col(k);
    }
    return total;
  }
};

template <class Kind>
class BatchOf : public ::testing::Test {
 protected:
  static constexpr int n = Kind::num_points;
  static constexpr unsigned num_clouds = 30;
};
// A kind of each number of points; potential_properties_test.cpp goes through all of them.
using BatchKinds = ::testing::Types<Length, TriangleArea, TetrahedronVolume>;
TYPED_TEST_SUITE(BatchOf, BatchKinds);

TYPED_TEST(BatchOf, EnergyAndForcesAreTheSumsOverItsElements) {
  WorstError energy_error, force_error;
  for (unsigned seed = 0; seed < this->num_clouds; ++seed) {
    const Cloud<TypeParam> c(seed);
    Real energy = 0;
    for (int e = 0; e < c.num_elements; ++e)
      energy += penalty::energy(c.batch.kinds()[e], c.batch.stiffnesses()[e], c.points_of(e, c.x));
    const PackedVectors forces =
        c.sum([&](int e) { return force(c.batch.kinds()[e], c.batch.stiffnesses()[e], c.points_of(e, c.x)); });
    ASSERT_GT(forces.norm(), 0);
    PackedVectors f = PackedVectors::Constant(4, c.num_particles, 2);  // must be added to
    energy_error.see(std::abs(c.batch.add_forces(c.x, f) - energy) / energy, seed);
    energy_error.see(std::abs(c.batch.energy(c.x) - energy) / energy, seed);
    f.array() -= 2;
    force_error.see(relative_error(f, forces), seed);
    EXPECT_TRUE(f.row(3).isZero(0)) << "padding was written, seed " << seed;
  }
  energy_error.expect_below(1e-13, "energy");
  force_error.expect_below(1e-13, "forces");
}

TYPED_TEST(BatchOf, DampingForcesAreTheSumsOverItsElements) {
  WorstError error;
  for (unsigned seed = 0; seed < this->num_clouds; ++seed) {
    const Cloud<TypeParam> c(seed);
    const Real time = 0.02;
    const PackedVectors expected = c.sum([&](int e) {
      return damping_force(c.batch.kinds()[e], time * c.batch.stiffnesses()[e], c.points_of(e, c.x),
                           c.points_of(e, c.v));
    });
    ASSERT_GT(expected.norm(), 0);
    error.see(relative_error(damping_forces(c.batch, c.x, c.v, time), expected), seed);
  }
  error.expect_below(1e-13, "damping forces");
}

TYPED_TEST(BatchOf, ValuesComeInTheOrderOfTheElements) {
  const Cloud<TypeParam> c(1);
  const std::vector<Real> values = strains(c.batch, c.x);
  ASSERT_EQ(values.size(), c.num_elements + 0u);
  for (int e = 0; e < c.num_elements; ++e) EXPECT_EQ(values[e], c.batch.kinds()[e].value(c.points_of(e, c.x)));
}

TYPED_TEST(BatchOf, StiffnessIsTheSumOfTheElementBlocks) {
  for (const auto model : {StiffnessModel::gauss_newton, StiffnessModel::exact, StiffnessModel::psd_projected}) {
    const Cloud<TypeParam> c(2);
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(3 * c.num_particles, 3 * c.num_particles);
    for (int e = 0; e < c.num_elements; ++e) {
      const auto k = stiffness_matrix(c.batch.kinds()[e], c.batch.stiffnesses()[e], c.points_of(e, c.x), model);
      for (int i = 0; i < this->n; ++i)
        for (int j = 0; j < this->n; ++j)
          expected.block<3, 3>(3 * c.batch.stencils()[e][i], 3 * c.batch.stencils()[e][j]) +=
              k.template block<3, 3>(3 * i, 3 * j);
    }
    ASSERT_GT(expected.norm(), 0);
    EXPECT_LT(relative_error(assembled(c.batch, c.x, model).to_dense(), expected), 1e-14);
  }
}

TYPED_TEST(BatchOf, NameAndSizeAreReported) {
  const Cloud<TypeParam> c(3);
  EXPECT_EQ(c.batch.name(), TypeParam::name);
  EXPECT_EQ(c.batch.num_elements(), c.num_elements + 0u);
}

TYPED_TEST(BatchOf, DissipationKeepsMomentumAndOnlyLowersKineticEnergyForAnyDamping) {
  WorstError linear, angular;
  for (unsigned seed = 0; seed < this->num_clouds; ++seed) {
    Cloud<TypeParam> c(seed);
    c.inverse_masses[3] = 1;
    for (const Real time : {1e-6, 1e-3, 1.0, 1e3, 1e12}) {
      PackedVectors v = c.v;
      c.batch.dissipate(c.x, c.inverse_masses, time, 0.1, v);
      ASSERT_GT((v - c.v).norm(), 0);
      Vector3 dp = Vector3::Zero(), dl = Vector3::Zero();
      Real before = 0, after = 0, scale = 0;
      for (int i = 0; i < c.num_particles; ++i) {
        const Vector3 x = c.x.col(i).template head<3>(), dv = (v - c.v).col(i).template head<3>();
        const Real m = 1 / c.inverse_masses[i];
        dp += m * dv;
        dl += m * x.cross(dv);
        before += m * c.v.col(i).squaredNorm();
        after += m * v.col(i).squaredNorm();
        scale += m * c.v.col(i).norm();
      }
      linear.see(dp.norm() / scale, seed);
      angular.see(dl.norm() / scale, seed);
      EXPECT_LT(after, before) << "time " << time << ", seed " << seed;
    }
  }
  linear.expect_below(1e-14, "linear momentum");
  angular.expect_below(1e-14, "angular momentum");
}

TYPED_TEST(BatchOf, DissipationLeavesPinnedParticlesAlone) {
  const Cloud<TypeParam> c(4);
  ASSERT_EQ(c.inverse_masses[3], 0);
  PackedVectors v = c.v;
  c.batch.dissipate(c.x, c.inverse_masses, 1, 1, v);
  EXPECT_EQ(v.col(3), c.v.col(3));
  EXPECT_NE(v.col(4), c.v.col(4));
}

TYPED_TEST(BatchOf, DissipationOfOneElementIsTheImplicitStepAlongItsGradient) {
  // v' = v + M^-1 gᵀ lambda with lambda = -d h (g . v'), d = time * K: the damping force of the end velocity.
  WorstError error;
  int effective = 0;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    Random random(seed);
    const Real stiffness = 7, time = 0.3, duration = 0.2;
    const auto made = make_batch<TypeParam>(this->n);
    Batch<TypeParam>& batch = *made;
    std::array<int, TypeParam::num_points> stencil;
    for (int k = 0; k < this->n; ++k) stencil[k] = k;
    batch.add(stencil, s.kind, stiffness);
    const PackedVectors start = random_packed(this->n, 1, random);
    PackedVectors v = start;
    const std::vector<Real> inverse_masses = random_inverse_masses(this->n, random);
    batch.dissipate(pack(s.points), inverse_masses, time, duration, v);
    effective += (v - start).norm() > 0.1 * start.norm();
    const Points<TypeParam::num_points> end = v.template topRows<3>();
    const Gradient<TypeParam::num_points> f = damping_force(s.kind, time * stiffness, s.points, end);
    // Round-off in g . v' comes back multiplied with d h |g|².
    const Real gain = 1 + duration * time * stiffness * s.kind.gradient(s.points).squaredNorm();
    for (int k = 0; k < this->n; ++k)
      error.see(((v - start).col(k).template head<3>() - duration * inverse_masses[k] * f.col(k)).norm() /
                    (start.norm() * gain),
                seed);
  }
  EXPECT_GT(effective, 100);
  error.expect_below(1e-14, "implicit damping");
}

// Every error starts with "<kind> <element>: " and has the number in it.
template <class Kind>
void expect_refusal(const std::array<int, Kind::num_points>& stencil, Real stiffness, const std::string& what) {
  const auto made = make_batch<Kind>(5);
  Batch<Kind>& batch = *made;
  std::array<int, Kind::num_points> good;
  for (int k = 0; k < Kind::num_points; ++k) good[k] = k;
  const Kind kind = sample<Kind>(0).kind;
  for (int e = 0; e < 2; ++e) batch.add(good, kind, 1);
  const std::string message = complaint<std::invalid_argument>([&] { batch.add(stencil, kind, stiffness); });
  EXPECT_EQ(message, std::string(Kind::name) + " 2: " + what);
  EXPECT_EQ(batch.num_elements(), 2u) << "a refused element was added";
}

TYPED_TEST(BatchOf, RefusedElementsNameKindElementAndValue) {
  std::array<int, TypeParam::num_points> good;
  for (int k = 0; k < this->n; ++k) good[k] = k;
  auto outside = good, negative = good, twice = good;
  outside[1] = 5;
  negative[0] = -7;
  twice[1] = 0;
  expect_refusal<TypeParam>(outside, 1, "index 5 is outside the 5 particles");
  expect_refusal<TypeParam>(negative, 1, "index -7 is outside the 5 particles");
  expect_refusal<TypeParam>(twice, 1, "index 0 appears twice");
  expect_refusal<TypeParam>(good, 0, "stiffness is 0 J, must be positive and finite");
  expect_refusal<TypeParam>(good, -2.5, "stiffness is -2.5 J, must be positive and finite");
  expect_refusal<TypeParam>(good, std::nan(""), "stiffness is nan J, must be positive and finite");
  expect_refusal<TypeParam>(good, std::numeric_limits<Real>::infinity(),
                            "stiffness is inf J, must be positive and finite");
}

TEST(Batch, ARefusedTinyStiffnessIsNotReportedAsZero) {
  const auto batch = make_batch<Length>(2);
  Points<2> rest;
  rest << Vector3(0, 0, 0), Vector3(1, 0, 0);
  const std::string message =
      complaint<std::invalid_argument>([&] { batch->add({0, 1}, Length::at_rest(rest), -2e-9); });
  EXPECT_NE(message.find("2e-09"), std::string::npos) << message;
}

// A kind of a user's own, without Hessian and without the one-pass kernel: C = p0 . p1 / |rest| - 1 is not rigid, but
// nothing in a batch asks for that.
struct Plain {
  static constexpr std::string_view name = "plain";
  static constexpr int num_points = 2;
  Real scale;
  Real value(const Points<2>& p) const { return scale * p.col(0).dot(p.col(1)) - 1; }
  Gradient<2> gradient(const Points<2>& p) const {
    Gradient<2> g;
    g << scale * p.col(1), scale * p.col(0);
    return g;
  }
};
static_assert(Constraint<Plain> && !HasHessian<Plain> && !HasValueAndGradient<Plain>);

TEST(Batch, OfAKindFromOutsideNeedsOnlyValueAndGradient) {
  Batch<Plain> batch(2);
  batch.add({0, 1}, Plain{0.5}, 3);
  Random random(1);
  const PackedVectors x = random_packed(2, 1, random);
  const Points<2> p = x.topRows<3>();
  PackedVectors f = PackedVectors::Zero(4, 2);
  EXPECT_DOUBLE_EQ(batch.add_forces(x, f), energy(Plain{0.5}, 3, p));
  EXPECT_LT(relative_error(f.topRows<3>(), force(Plain{0.5}, 3, p)), 1e-15);
  const Eigen::MatrixXd gauss_newton = assembled(batch, x, StiffnessModel::gauss_newton).to_dense();
  ASSERT_GT(gauss_newton.norm(), 0);
  EXPECT_EQ(assembled(batch, x, StiffnessModel::exact).to_dense(), gauss_newton);
}

}  // namespace
}  // namespace penalty::testing
