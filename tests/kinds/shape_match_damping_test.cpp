// Damping of shape matching: it takes all but rigid motion.
#include "kinds/shape_match_samples.h"

namespace penalty::testing {
namespace {

TEST(ShapeMatch, DampingMatrixIsThatOfTheDampingForce) {
  WorstError error;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const GroupSample s = sample(seed);
    const Points<dynamic> v = Random(seed).vectors<dynamic>(s.points.cols(), 1);
    Gradient<dynamic> product = Gradient<dynamic>::Zero(3, v.cols());
    s.kind.visit_damping(
        s.points, [&](int i, Real value) { product.col(i) += value * v.col(i); },
        [&](Real coefficient, const Gradient<dynamic>& mode) {
          product += coefficient * mode.cwiseProduct(v).sum() * mode;
        });
    const Gradient<dynamic> f = s.kind.damping_force(s.points, v, 0.7);
    ASSERT_GT(f.norm(), 0);
    error.see(relative_error(-0.7 * product, f), seed);
  }
  error.expect_below(1e-10, "damping matrix");
}

// Momentum of masses about the origin, linear and angular.
std::pair<Vector3, Vector3> momenta(const Points<dynamic>& p, const Points<dynamic>& v,
                                    const std::vector<Real>& inverse) {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    linear += v.col(i) / inverse[i];
    angular += p.col(i).cross(v.col(i)) / inverse[i];
  }
  return {linear, angular};
}

Real kinetic_energy(const Points<dynamic>& v, const std::vector<Real>& inverse) {
  Real sum = 0;
  for (Eigen::Index i = 0; i < v.cols(); ++i)
    if (inverse[i] > 0) sum += v.col(i).squaredNorm() / inverse[i] / 2;
  return sum;
}

TEST(ShapeMatch, DampingKeepsBothMomentaAndEndsInRigidMotion) {
  WorstError linear_drift, angular_drift, remainder;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 200; ++seed) {
      const GroupSample s = sample(seed, group);
      // Points of the line itself, turned: a group without a full inertia tensor.
      const Points<dynamic> p = (group == Group::collinear ? s.rest : s.points) / s.size;
      const ShapeMatch kind = ShapeMatch(s.weights).at_rest(s.rest / s.size);
      Random random(seed + 2000);
      const auto n = p.cols();
      std::vector<Real> inverse;
      inverse.reserve(n);
      for (Eigen::Index i = 0; i < n; ++i) inverse.push_back(random.uniform(0.3, 3));
      Points<dynamic> v = random.vectors<dynamic>(n, 1);
      const auto before = momenta(p, v, inverse);
      const Real energy = kinetic_energy(v, inverse);
      kind.damp(p, inverse, 0.7, v);
      EXPECT_LT(kinetic_energy(v, inverse), energy);
      kind.damp(p, inverse, 1e20, v);
      const auto after = momenta(p, v, inverse);
      linear_drift.see((after.first - before.first).norm(), seed);
      angular_drift.see((after.second - before.second).norm(), seed);
      // Rigid: every distance keeps its length.
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < i; ++j) remainder.see(std::abs((v.col(i) - v.col(j)).dot(p.col(i) - p.col(j))), seed);
    }
  linear_drift.expect_below(1e-12, "linear momentum");
  angular_drift.expect_below(1e-12, "angular momentum");
  remainder.expect_below(1e-12, "rate of a distance");
}

TEST(ShapeMatch, DampingDividesTheRateOfSwelling) {
  const ShapeMatch kind = ShapeMatch().at_rest(cube());
  Points<dynamic> v = cube().array() - 0.5;  // swelling at 1/s; S0 = 8 * 3/4 = 6
  const std::vector<Real> inverse(8, 0.5);   // M = 16
  kind.damp(cube(), inverse, 3, v);          // r = 3 * 8 / (6 * 16)
  EXPECT_LT((v - Points<dynamic>((cube().array() - 0.5) / 1.25)).norm(), 1e-15);
}

TEST(ShapeMatch, DampingWithAPinAtRestOnlyTakesEnergyWhateverTheMasses) {
  int damped = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const GroupSample s = sample(seed);
    Random random(seed);
    std::vector<Real> inverse(s.rest.cols());
    for (Real& w : inverse) w = std::pow(10.0, random.uniform(-4, 2));
    inverse[0] = 0;
    Points<dynamic> start = random.vectors<dynamic>(s.rest.cols(), 1);
    start.col(0).setZero();
    const auto kinetic = [&](const Points<dynamic>& v) {
      Real sum = 0;
      for (Eigen::Index i = 1; i < v.cols(); ++i) sum += v.col(i).squaredNorm() / inverse[i] / 2;
      return sum;
    };
    for (const Real damping : {1e-6, 1e-2, 1.0, 1e4}) {
      Points<dynamic> v = start;
      s.kind.damp(s.points, inverse, damping * s.size * s.size, v);
      EXPECT_LE(kinetic(v), kinetic(start) * (1 + 1e-12)) << "seed " << seed << ", damping " << damping;
      damped += kinetic(v) < 0.99 * kinetic(start);
    }
  }
  EXPECT_GT(damped, 100);
}

TEST(ShapeMatch, DampingLeavesPinsAlone) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const GroupSample s = sample(seed);
    Random random(seed);
    std::vector<Real> inverse(s.rest.cols(), 2.0);
    inverse[1] = 0;
    const Points<dynamic> start = random.vectors<dynamic>(s.rest.cols(), 1);
    Points<dynamic> v = start;
    s.kind.damp(s.points, inverse, s.size * s.size, v);
    EXPECT_EQ(v.col(1), start.col(1));
    EXPECT_GT((v - start).norm(), 1e-3);
    EXPECT_TRUE(v.allFinite());
    // A rigid motion that the pin takes part in is not damped.
    const Vector3 spin = random.vector(1);
    for (Eigen::Index i = 0; i < v.cols(); ++i)
      v.col(i) = spin.cross(Vector3(s.points.col(i) - s.points.col(1))) / s.size;
    const Points<dynamic> rigid = v;
    s.kind.damp(s.points, inverse, s.size * s.size, v);
    EXPECT_LT((v - rigid).norm(), 1e-13);
    // All pinned: nothing happens.
    std::fill(inverse.begin(), inverse.end(), 0.0);
    v = start;
    s.kind.damp(s.points, inverse, 1, v);
    EXPECT_EQ(v, start);
  }
}

TEST(ShapeMatch, DampingForceDissipatesWithoutNetForceAndTorque) {
  WorstError force, torque, rigid;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 200; ++seed) {
      const GroupSample s = sample(seed, group);
      Random random(seed);
      const Points<dynamic> p = group == Group::collinear ? s.rest : s.points;
      const Points<dynamic> v = random.vectors<dynamic>(p.cols(), 1);
      const Gradient<dynamic> f = s.kind.damping_force(p, v, 2);
      ASSERT_GT(f.norm(), 0);
      EXPECT_LT(f.cwiseProduct(v).sum(), 0);
      force.see(net_force<dynamic>(f), seed);
      torque.see(net_torque<dynamic>(p, f), seed);
      Points<dynamic> turning = p / s.size;
      const Vector3 spin = random.vector(1), drift = random.vector(1);
      for (Eigen::Index i = 0; i < p.cols(); ++i) turning.col(i) = drift + spin.cross(Vector3(p.col(i))) / s.size;
      rigid.see(s.kind.damping_force(p, turning, 2).norm() / f.norm(), seed);
    }
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
  rigid.expect_below(1e-12, "force on a rigid motion");
}

}  // namespace
}  // namespace penalty::testing
