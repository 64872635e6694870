#include <limits>

#include "kinds/shape_match_samples.h"
#include "math/eigenvalues.h"
#include "penalty/math/finite_difference.h"

namespace penalty::testing {
namespace {

static_assert(ElasticEnergy<ShapeMatch>);

Matrix3 correlation(const GroupSample& s) {  // sum w p qᵀ
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
bool is_thin(const GroupSample& s, Group group) {
  GroupSample at_rest = s;
  at_rest.points = s.rest;
  return group != Group::collinear && determinacy(correlation(at_rest)) < 0.01;
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
      const GroupSample s = sample(seed, group);
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
    const GroupSample s = sample(seed);
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
      const GroupSample s = sample(seed, group);
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
      const GroupSample s = sample(seed, group);
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

TEST(ShapeMatch, KeepsItsDigitsFarFromTheOrigin) {
  WorstError force, torque, damping, energy;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const GroupSample s = sample(seed);
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
      const GroupSample s = sample(seed, group);
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
      const GroupSample s = sample(seed, group);
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
      const GroupSample s = sample(seed, group);
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
