#include "kinds/samples.h"
#include "penalty/energy/penalty_energy.h"

namespace penalty::testing {
namespace {

template <class Kind>
class DampingForce : public ::testing::Test {
 protected:
  static constexpr int n = Kind::num_points;
};
TYPED_TEST_SUITE(DampingForce, ConstraintTypes);

TYPED_TEST(DampingForce, DissipatesDampingTimesTheSquaredRate) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    SCOPED_TRACE(trace(s));
    const Points<TestFixture::n> v = Random(seed + 2000).vectors<TestFixture::n>(TestFixture::n, 3);
    const Real damping = 0.7;
    const Real power = damping_force(s.kind, damping, s.points, v).cwiseProduct(v).sum();
    EXPECT_LE(power, 0);
    // dC/dt from the positions a moment later and earlier.
    const Real moment = 1e-6 * s.size;
    const Real rate = (s.kind.value(s.points + moment * v) - s.kind.value(s.points - moment * v)) / (2 * moment);
    const Real scale = s.kind.gradient(s.points).norm() * v.norm();
    ASSERT_GT(scale, 0);
    error.see(std::abs(power + damping * rate * rate) / (damping * scale * scale), seed);
  }
  error.expect_below(1e-8, "relative error of the power");
}

template <class Kind>
class InternalDampingForce : public DampingForce<Kind> {};
TYPED_TEST_SUITE(InternalDampingForce, InternalTypes);

TYPED_TEST(InternalDampingForce, HasNoNetForceAndNoNetTorque) {
  WorstError net, torque;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    const Points<TestFixture::n> v = Random(seed + 2000).vectors<TestFixture::n>(TestFixture::n, 3);
    const Gradient<TestFixture::n> f = damping_force(s.kind, 1, s.points, v);
    ASSERT_GT(f.norm(), 0) << trace(s);
    net.see(net_force<TestFixture::n>(f), seed);
    torque.see(net_torque<TestFixture::n>(s.points, f), seed);
  }
  net.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TYPED_TEST(InternalDampingForce, LeavesRigidMotionAlone) {
  WorstError error;
  for (unsigned seed = 0; seed < num_samples; ++seed) {
    const auto s = sample<TypeParam>(seed);
    Random random(seed + 3000);
    const Vector3 spin = random.vector(2), drift = random.vector(2 * s.size);
    Points<TestFixture::n> v;
    for (int k = 0; k < TestFixture::n; ++k) v.col(k) = drift + spin.cross(s.points.col(k));
    ASSERT_GT(v.norm(), 0);
    const Real scale = s.kind.gradient(s.points).squaredNorm() * v.norm();
    error.see(damping_force(s.kind, 1, s.points, v).norm() / scale, seed);
  }
  error.expect_below(1e-13, "relative force");
}

}  // namespace
}  // namespace penalty::testing
