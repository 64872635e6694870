#include "penalty/kinds/shape_match.h"

#include <limits>

#include "kinds/samples.h"
#include "math/eigenvalues.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

static_assert(ElasticEnergy<ShapeMatch>);

enum class Group { solid, planar, collinear };

struct Sample {
  Points<dynamic> rest, points;
  std::vector<Real> weights;
  ShapeMatch kind;
  Real size;  // [m]
};

Points<dynamic> rest_points(Random& random, Group group, int n) {
  Points<dynamic> rest = random.vectors<dynamic>(n, 1);
  if (group != Group::solid) rest.row(2).setZero();
  if (group == Group::collinear) rest.row(1).setZero();
  return random.rotation() * rest;
}

// Noisy, stretched, compressed, inverted and arbitrary groups of 3 to 8 points, of any size, somewhere.
Sample sample(unsigned seed, Group group = Group::solid) {
  Random random(seed);
  const int n = 3 + static_cast<int>(random.index(6)) + (group == Group::solid ? 1 : 0);
  const Points<dynamic> rest = rest_points(random, group, n);
  Matrix3 change = Matrix3::Identity();
  const Vector3 axis = random.direction();
  const Real factor = std::array<Real, 5>{1, 2.5, 0.3, -0.6, 1}[seed % 5];
  change += (factor - 1) * axis * axis.transpose();
  Points<dynamic> points = random.rotation() * change * rest + random.vectors<dynamic>(n, seed % 5 == 4 ? 1.0 : 0.1);
  points.colwise() += random.vector(2);
  std::vector<Real> weights;
  weights.reserve(n);
  for (int i = 0; i < n; ++i) weights.push_back(random.uniform(0.5, 3));
  const Real size = std::pow(10.0, random.uniform(-3, 3));
  return {size * rest, size * points, weights, ShapeMatch(weights).at_rest(size * rest), size};
}

Matrix3 correlation(const Sample& s) {  // sum w p qᵀ
  Matrix3 a = Matrix3::Zero();
  Vector3 p_mean = Vector3::Zero(), q_mean = Vector3::Zero();
  Real total = 0;
  for (std::size_t i = 0; i < s.weights.size(); ++i) {
    p_mean += s.weights[i] * s.points.col(i);
    q_mean += s.weights[i] * s.rest.col(i);
    total += s.weights[i];
  }
  for (std::size_t i = 0; i < s.weights.size(); ++i)
    a += s.weights[i] * (s.points.col(i) - p_mean / total) * (s.rest.col(i) - q_mean / total).transpose();
  return a;
}

// How well the best rotation is determined: (s2 + s3) / s1 with a signed s3.
Real determinacy(const Matrix3& a) {
  const Vector3 s = singular_values(a);
  return (s[1] + std::copysign(s[2], a.determinant())) / s[0];
}

// Nearly, not quite, on a line: the rotation about it costs digits, as round-off over (s2 + s3) / s1.
bool is_thin(const Sample& s, Group group) {
  Sample at_rest = s;
  at_rest.points = s.rest;
  return group != Group::collinear && determinacy(correlation(at_rest)) < 0.01;
}

Points<dynamic> cube() {
  Points<dynamic> p(3, 8);
  for (int i = 0; i < 8; ++i) p.col(i) = Vector3(i & 1, i >> 1 & 1, i >> 2);
  return p;
}

TEST(ShapeMatch, ScalingBySCostsHalfTheSquareOfSLessOne) {
  const ShapeMatch kind = ShapeMatch().at_rest(cube());
  for (const Real s : {0.01, 0.5, 1.0, 1.5, 3.0}) {
    EXPECT_NEAR(kind.energy(s * cube()), (s - 1) * (s - 1) / 2, 1e-15 * (1 + s * s)) << s;
    EXPECT_NEAR(kind.value(s * cube()), std::abs(s - 1), 1e-15 * (1 + s)) << s;
  }
  EXPECT_DOUBLE_EQ(kind.energy(0 * cube()), 0.5);
}

TEST(ShapeMatch, RigidMotionCostsNothing) {
  WorstError error, gradient_error;
  int checked = 0;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 200; ++seed) {
      const Sample s = sample(seed, group);
      if (is_thin(s, group)) continue;
      ++checked;
      Random random(seed + 1000);
      Points<dynamic> moved = random.rotation() * (s.rest / s.size);
      moved.colwise() += random.vector(1);
      const ShapeMatch kind = ShapeMatch(s.weights).at_rest(s.rest / s.size);
      error.see(kind.value(moved), seed);
      Gradient<dynamic> g(3, moved.cols());
      kind.energy_and_gradient(moved, g);
      gradient_error.see(g.norm(), seed);
    }
  EXPECT_GT(checked, 500);
  error.expect_below(3e-15, "deviation");
  gradient_error.expect_below(1e-14, "gradient");
}

TEST(ShapeMatch, EnergyIsTheLeastOverManyRotations) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Sample s = sample(seed);
    const Real energy = s.kind.energy(s.points);
    Random random(seed);
    const Matrix3 a = correlation(s), best = s.kind.rotation(s.points);
    for (int k = 0; k < 300; ++k) {
      const Matrix3 r = k % 3 == 0
                            ? Matrix3(Eigen::AngleAxis<Real>(random.uniform(-0.01, 0.01), random.direction()) * best)
                            : random.rotation();
      EXPECT_LE((r.transpose() * a).trace(), (best.transpose() * a).trace() + 1e-12 * a.norm()) << "seed " << seed;
    }
    EXPECT_GT(energy, 1e-6);
  }
}

TEST(ShapeMatch, GradientIsTheDerivativeOfTheEnergyWithoutNetForceAndTorque) {
  WorstError error, force, torque;
  int checked = 0;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 200; ++seed) {
      const Sample s = sample(seed, group);
      if (group != Group::collinear && determinacy(correlation(s)) < 0.05) continue;  // near the kink
      ++checked;
      Gradient<dynamic> g = Gradient<dynamic>::Constant(3, s.points.cols(), std::numeric_limits<Real>::quiet_NaN());
      const Real energy = s.kind.energy_and_gradient(s.points, g);
      EXPECT_NEAR(energy, s.kind.energy(s.points), 1e-14 * (1 + energy));
      ASSERT_GT(g.norm() * s.size, 1e-3);
      const auto differences = central_difference_gradient<dynamic>([&](const auto& p) { return s.kind.energy(p); },
                                                                    s.points, 1e-5 * s.size);
      error.see(relative_error(differences, g), seed);
      force.see(net_force<dynamic>(g), seed);
      torque.see(net_torque<dynamic>(s.points, g), seed);
    }
  EXPECT_GT(checked, 500);
  error.expect_below(1e-7, "gradient");
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
}

TEST(ShapeMatch, HessianIsTheDerivativeOfTheGradient) {
  WorstError error, asymmetry;
  int checked = 0;
  for (const Group group : {Group::solid, Group::planar})
    for (unsigned seed = 0; seed < 200; ++seed) {
      const Sample s = sample(seed, group);
      if (determinacy(correlation(s)) < 0.1) continue;
      ++checked;
      const auto gradient = [&](const Points<dynamic>& p) {
        Gradient<dynamic> g(3, p.cols());
        s.kind.energy_and_gradient(p, g);
        return g;
      };
      const Hessian<dynamic> h = s.kind.energy_hessian(s.points);
      ASSERT_GT(h.norm() * s.size * s.size, 0.1);
      error.see(relative_error(central_difference_hessian<dynamic>(gradient, s.points, 1e-5 * s.size), h), seed);
      asymmetry.see(relative_error(h.transpose(), h), seed);
    }
  EXPECT_GT(checked, 300);
  error.expect_below(1e-5, "hessian");
  asymmetry.expect_below(1e-14, "asymmetry");
}

TEST(ShapeMatch, DampingMatrixIsThatOfTheDampingForce) {
  WorstError error;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Sample s = sample(seed);
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

TEST(ShapeMatch, KeepsItsDigitsFarFromTheOrigin) {
  WorstError force, torque, damping, energy;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Sample s = sample(seed);
    Random random(seed);
    const Points<dynamic> p = s.points.colwise() + 1e4 * s.size * random.direction();
    const Points<dynamic> near = p.colwise() - p.col(0).eval();  // exact but for the rounding of p itself
    Gradient<dynamic> g(3, p.cols());
    energy.see(std::abs(s.kind.energy_and_gradient(p, g) - s.kind.energy(near)), seed);
    force.see(net_force<dynamic>(g), seed);
    torque.see(net_torque<dynamic>(p, g), seed);
    const Gradient<dynamic> f = s.kind.damping_force(p, random.vectors<dynamic>(p.cols(), 1), 1);
    damping.see(net_force<dynamic>(f) + net_torque<dynamic>(p, f), seed);
  }
  force.expect_below(1e-12, "net force");
  torque.expect_below(1e-12, "net torque");
  damping.expect_below(1e-12, "net force and torque of damping");
  energy.expect_below(1e-14, "dependence on the origin");
}

Hessian<dynamic> assembled(const ShapeMatch& kind, const Points<dynamic>& p, bool psd) {
  Hessian<dynamic> h = Hessian<dynamic>::Zero(p.size(), p.size());
  kind.visit_stiffness(
      p, psd, [&](int i, Real factor) { h.diagonal().segment<3>(3 * i).array() += factor; },
      [&](Real coefficient, const Gradient<dynamic>& mode) {
        EXPECT_LT(coefficient, 0);
        h += coefficient * mode.reshaped() * mode.reshaped().transpose();
      });
  return h;
}

TEST(ShapeMatch, PositiveSemidefiniteStiffnessHasNoNegativeEigenvalue) {
  WorstError negative, lost;
  int indefinite = 0;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 300; ++seed) {
      const Sample s = sample(seed, group);
      const Hessian<dynamic> exact = s.kind.energy_hessian(s.points), psd = assembled(s.kind, s.points, true);
      indefinite += smallest_eigenvalue(exact) < -1e-6 * psd.norm();
      negative.see(-smallest_eigenvalue(psd) / psd.norm(), seed);
      lost.see(-smallest_eigenvalue(psd - exact) / exact.norm(), seed);  // it only adds
    }
  EXPECT_GT(indefinite, 200);
  negative.expect_below(1e-14, "lowest eigenvalue");
  lost.expect_below(1e-14, "lowest eigenvalue of the difference");
}

TEST(ShapeMatch, AtRestBothStiffnessesAgreeAndRigidMotionsAreFree) {
  WorstError difference, rigid;
  int checked = 0;
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 100; ++seed) {
      const Sample s = sample(seed, group);
      if (is_thin(s, group)) continue;
      ++checked;
      const Hessian<dynamic> exact = s.kind.energy_hessian(s.rest);
      difference.see(relative_error(assembled(s.kind, s.rest, true), exact), seed);
      Random random(seed);
      const Vector3 spin = random.direction(), drift = s.size * random.vector(1);
      Points<dynamic> motion = s.rest;
      for (Eigen::Index i = 0; i < motion.cols(); ++i) motion.col(i) = drift + spin.cross(Vector3(s.rest.col(i)));
      rigid.see((exact * motion.reshaped()).norm() / (exact.norm() * motion.norm()), seed);
      EXPECT_GT(exact.norm() * s.size * s.size, 0.1);
    }
  EXPECT_GT(checked, 250);
  difference.expect_below(1e-13, "difference");
  rigid.expect_below(1e-13, "stiffness of a rigid motion");
}

TEST(ShapeMatch, AMirrorImageIsDeformedAndPulledBack) {
  Points<dynamic> rest = cube();
  rest.row(0) *= 3;
  rest.row(1) *= 2;  // mirrored along the shortest side: the best rotation is the identity
  const ShapeMatch kind = ShapeMatch().at_rest(rest);
  Points<dynamic> mirror = rest;
  mirror.row(2) *= -1;
  EXPECT_LT((kind.rotation(mirror) - Matrix3::Identity()).norm(), 1e-14);
  // sum |p - g|² = 8 * 1², S0 = 8 (9 + 4 + 1) / 4: C = sqrt(4 / 14).
  EXPECT_NEAR(kind.value(mirror), std::sqrt(4.0 / 14), 1e-14);
  Gradient<dynamic> g(3, 8);
  kind.energy_and_gradient(mirror, g);
  for (int i = 0; i < 8; ++i) EXPECT_LT(g(2, i) * (rest(2, i) - 0.5), 0);  // -dpsi/dp points to the rest height
}

TEST(ShapeMatch, IsFiniteForCollapsedGroups) {
  for (const Group group : {Group::solid, Group::planar, Group::collinear})
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Sample s = sample(seed, group);
      const Eigen::Index n = s.rest.cols();
      Points<dynamic> plane = s.rest, line = s.rest, spot = s.rest;
      plane.row(2).setZero();
      line.bottomRows<2>().setZero();
      spot.colwise() = s.size * Vector3(0.1, 0.2, 0.3);
      for (const Points<dynamic>& p : {plane, line, spot, Points<dynamic>(-s.rest)}) {
        Gradient<dynamic> g(3, n);
        EXPECT_TRUE(std::isfinite(s.kind.energy_and_gradient(p, g)));
        EXPECT_TRUE(g.allFinite());
        EXPECT_GE(s.kind.energy(p), 0);
        EXPECT_TRUE(s.kind.energy_hessian(p).allFinite());
        EXPECT_TRUE(assembled(s.kind, p, true).allFinite());
      }
      Gradient<dynamic> g(3, n);
      EXPECT_NEAR(s.kind.energy_and_gradient(spot, g), 0.5, 1e-14);
      EXPECT_GT(g.norm() * s.size, 0.1);  // blown up again
    }
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
      const Sample s = sample(seed, group);
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
    const Sample s = sample(seed);
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
    const Sample s = sample(seed);
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
      const Sample s = sample(seed, group);
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

TEST(ShapeMatch, RefusesBadGroupsAndSaysWhy) {
  const auto refusal = [](const ShapeMatch& prototype, const Points<dynamic>& rest) {
    return complaint<std::invalid_argument>([&] { prototype.at_rest(rest); });
  };
  EXPECT_EQ(refusal(ShapeMatch(), cube().leftCols(2)), "shape match: 2 points, must be at least 3");
  EXPECT_EQ(refusal(ShapeMatch({1, 2, 3}), cube()), "shape match: 8 points and 3 weights");
  EXPECT_EQ(refusal(ShapeMatch(), Points<dynamic>::Constant(3, 4, 0.1)),
            "shape match: weighted sum of squared distances to the rest centre is 0");
  Points<dynamic> bad = cube();
  bad(0, 5) = std::numeric_limits<Real>::infinity();
  EXPECT_NE(refusal(ShapeMatch(), bad).find("nan"), std::string::npos);
  EXPECT_EQ(complaint<std::invalid_argument>([] { ShapeMatch({1, 0, 1}); }),
            "shape match: weight 1 is 0, must be positive and finite");
}

}  // namespace
}  // namespace penalty::testing
