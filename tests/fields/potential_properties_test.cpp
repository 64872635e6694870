// The laws that every potential obeys: each kind and material, plain and under each modifier, through the interface
// that the solvers see.
#include "fields/potential_cases.h"
#include "math/eigenvalues.h"

namespace penalty::testing {
namespace {

constexpr unsigned num_states = 200;

/// An element in a deformed state.
struct State {
  const KindCase* kind;
  PotentialField field;
  ElementBatch* batch;
  PackedVectors x, v, dx;
  std::vector<Real> inverse_masses;
  bool is_slack = false;
};

/// Derivative along one coordinate of whatever `f(x)` gives: five points, so that states close to a kink are
/// differentiated as well as others.
template <class Function>
auto derivative(const Function& f, PackedVectors x, Eigen::Index i, int axis) {
  const Real h = 2e-5, start = x(axis, i);
  const auto at = [&](Real offset) {
    x(axis, i) = start + offset;
    return f(x);
  };
  using Result = decltype(f(x));
  const Result near_above = at(h), near_below = at(-h), far_above = at(2 * h), far_below = at(-2 * h);
  return Result((8 * (near_above - near_below) - (far_above - far_below)) / (12 * h));
}

class PotentialProperties : public ::testing::TestWithParam<Case> {
 protected:
  const KindCase& kind() const { return *GetParam().first; }
  const ModifierCase& modifier() const { return *GetParam().second; }

  // At rest, stretched, squeezed, turned, inverted, noisy; away from the kinks at the ends of free play and from points
  // where the kind itself is singular.
  State state(unsigned seed) const {
    for (unsigned attempt = 0;; ++attempt) {
      Random random(1000 * seed + attempt);
      const int n = kind().num_points;
      const Eigen::Matrix3Xd rest = random.vectors<Eigen::Dynamic>(n, 0.5);
      Matrix3 stretch = Matrix3::Identity();
      for (Real& entry : stretch.reshaped()) entry += random.uniform(-0.4, 0.4);
      if (seed % 5 == 4) stretch.col(2) *= -1;
      Eigen::Matrix3Xd moved = random.rotation() * stretch * rest;
      moved += random.vectors<Eigen::Dynamic>(n, 0.1);
      moved.colwise() += random.vector(1);
      if (!kind().conserves_momentum) moved = rest + random.vectors<Eigen::Dynamic>(n, 0.3);
      State s{.kind = &kind(),
              .field = PotentialField(rest),
              .batch = nullptr,
              .x = {},
              .v = {},
              .dx = {},
              .inverse_masses = {}};
      try {
        s.batch = &kind().add(s.field, std::pow(10.0, random.uniform(-2, 4)));
      } catch (const std::invalid_argument&) {
        continue;
      }
      s.x = pack(moved);
      const std::vector<Real> bare = strains(*s.batch, s.x);
      PackedVectors f = PackedVectors::Zero(4, n);
      s.batch->add_forces(s.x, f);
      const Real k = s.batch->stiffness(0);
      const Real gradient = f.colwise().norm().sum() / (k * std::abs(bare[0]));
      if (!(gradient < 20) || !(std::abs(bare[0]) < 3)) continue;
      modifier().apply(*s.batch);
      const Real d = bare[0] - s.batch->target(0);
      bool near_kink = false;
      for (const Real kink : {-0.15, -0.1, 0.0, 0.1, 0.25}) near_kink = near_kink || std::abs(d - kink) < 0.01;
      if (near_kink) continue;
      s.is_slack = strains(*s.batch, s.x)[0] == 0;
      s.v = random_packed(n, 1, random);
      s.dx = random_packed(n, 1, random);
      s.inverse_masses = random_inverse_masses(n, random);
      return s;
    }
  }

  static PackedVectors forces(const PotentialField& field, const PackedVectors& x) {
    PackedVectors f = PackedVectors::Zero(4, x.cols());
    field.add_forces(x, f);
    return f;
  }

  static Eigen::MatrixXd stiffness(const PotentialField& field, const PackedVectors& x, StiffnessModel model) {
    return assembled(field, x, model).to_dense();
  }

  static std::string trace(unsigned seed) { return "seed " + std::to_string(seed); }
};

TEST_P(PotentialProperties, ForcesAreMinusTheDerivativeOfTheEnergy) {
  WorstError error;
  int taut = 0;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    const PackedVectors f = forces(s.field, s.x);
    if (s.is_slack) {
      EXPECT_EQ(f.norm(), 0) << trace(seed);
      EXPECT_EQ(s.field.energy(s.x), 0) << trace(seed);
      continue;
    }
    ++taut;
    PackedVectors differences = PackedVectors::Zero(4, s.x.cols());
    for (Eigen::Index i = 0; i < s.x.cols(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        differences(axis, i) = -derivative([&](const PackedVectors& x) { return s.field.energy(x); }, s.x, i, axis);
    error.see(relative_error(f, differences), seed);
  }
  EXPECT_GT(taut, static_cast<int>(num_states) / 20);
  error.expect_below(1e-7, "force");
}

// Of kinds with a Hessian; that of the others is Gauss-Newton's.
class ExactStiffness : public PotentialProperties {};

TEST_P(ExactStiffness, IsMinusTheDerivativeOfTheForces) {
  WorstError error, asymmetry;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    const Eigen::MatrixXd k = stiffness(s.field, s.x, StiffnessModel::exact);
    if (s.is_slack) {
      EXPECT_EQ(k.norm(), 0) << trace(seed);
      continue;
    }
    Eigen::MatrixXd differences(k.rows(), k.cols());
    for (Eigen::Index i = 0; i < s.x.cols(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const PackedVectors column =
            derivative([&](const PackedVectors& x) { return forces(s.field, x); }, s.x, i, axis);
        differences.col(3 * i + axis) = -column.topRows<3>().reshaped();
      }
    error.see(relative_error(k, differences), seed);
    asymmetry.see(relative_error(k.transpose(), k), seed);
  }
  error.expect_below(1e-5, "stiffness");
  asymmetry.expect_below(1e-12, "asymmetry");
}

TEST_P(PotentialProperties, ProductsOfTheSystemAreThoseOfTheDenseMatrix) {
  WorstError product_error, diagonal_error;
  for (unsigned seed = 0; seed < num_states / 4; ++seed) {
    const State s = state(seed);
    for (const StiffnessModel model :
         {StiffnessModel::gauss_newton, StiffnessModel::exact, StiffnessModel::psd_projected, StiffnessModel::taut}) {
      if (s.is_slack && model != StiffnessModel::taut) continue;
      const Eigen::MatrixXd k = stiffness(s.field, s.x, model);
      PackedVectors df = PackedVectors::Zero(4, s.x.cols());
      assembled(s.field, s.x, model).add_product(s.dx, 0.7, df);
      const Eigen::VectorXd expected = 0.7 * k * s.dx.topRows<3>().reshaped();
      product_error.see((df.topRows<3>().reshaped() - expected).norm() / (k.norm() * s.dx.norm()), seed);
      EXPECT_GT(k.norm(), 0) << trace(seed);
    }
    if (s.is_slack) continue;
    PackedVectors diagonal = PackedVectors::Zero(4, s.x.cols());
    assembled(s.field, s.x, StiffnessModel::gauss_newton).add_diagonal(2, diagonal);
    diagonal_error.see(relative_error(diagonal.topRows<3>().reshaped(),
                                      2 * stiffness(s.field, s.x, StiffnessModel::gauss_newton).diagonal()),
                       seed);
  }
  product_error.expect_below(1e-13, "product");
  diagonal_error.expect_below(1e-12, "diagonal");
}

TEST_P(PotentialProperties, ProjectedAndGaussNewtonStiffnessAreNeverNegative) {
  WorstError negative;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    for (const StiffnessModel model :
         {StiffnessModel::gauss_newton, StiffnessModel::psd_projected, StiffnessModel::taut}) {
      const Eigen::MatrixXd k = stiffness(s.field, s.x, model);
      if (k.norm() == 0) continue;
      const Real smallest = smallest_eigenvalue(k);
      negative.see(std::max(-smallest / k.norm(), 0.0), seed);
    }
  }
  negative.expect_below(1e-12, "negative eigenvalue");
}

TEST_P(PotentialProperties, BoundsAreNoLessThanTheEigenvalueOfTheTautStiffness) {
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    const Eigen::MatrixXd k = stiffness(s.field, s.x, StiffnessModel::taut);
    Eigen::VectorXd scale(k.rows());
    for (Eigen::Index i = 0; i < s.x.cols(); ++i) scale.segment<3>(3 * i).setConstant(std::sqrt(s.inverse_masses[i]));
    const Eigen::MatrixXd scaled = scale.asDiagonal() * k * scale.asDiagonal();
    const Real largest = symmetric_eigenvalues(scaled).maxCoeff();
    ASSERT_GT(largest, 0);
    std::vector<Real> bounds(s.inverse_masses.size(), 0);
    assembled(s.field, s.x, StiffnessModel::taut).add_bounds(bounds);
    Real bound = 0;
    for (std::size_t i = 0; i < bounds.size(); ++i) bound = std::max(bound, bounds[i] * s.inverse_masses[i]);
    EXPECT_GE(bound, largest * (1 - 1e-12)) << trace(seed);
    EXPECT_LE(bound, 40 * largest) << trace(seed) << ": too loose to be of use";
  }
}

// Of kinds that nothing outside holds.
class InternalForces : public PotentialProperties {};

TEST_P(InternalForces, HaveNoNetForceAndNoNetTorque) {
  WorstError force, torque;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    for (const PackedVectors& f : {forces(s.field, s.x), damping_forces(s.field, s.x, s.v, 0.1)}) {
      if (f.norm() == 0) continue;
      const Eigen::Matrix3Xd f3 = f.topRows<3>(), x3 = s.x.topRows<3>();
      Vector3 moment = Vector3::Zero();
      Real scale = 0;
      for (Eigen::Index i = 0; i < f3.cols(); ++i) {
        moment += Vector3(x3.col(i)).cross(Vector3(f3.col(i)));
        scale += x3.col(i).norm() * f3.col(i).norm();
      }
      force.see(f3.rowwise().sum().norm() / f3.colwise().norm().sum(), seed);
      torque.see(moment.norm() / scale, seed);
    }
  }
  const Real tolerance = kind().has_exact_stiffness ? 1e-12 : 1e-9;  // differences are no better
  force.expect_below(tolerance, "net force");
  torque.expect_below(tolerance, "net torque");
}

TEST_P(PotentialProperties, DampingTakesEnergyAndKeepsMomentum) {
  WorstError linear, angular;
  int damped = 0, taut = 0;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    const PackedVectors f = damping_forces(s.field, s.x, s.v, 0.1);
    EXPECT_LE(f.cwiseProduct(s.v).sum(), 0) << trace(seed);
    taut += !s.is_slack;
    if (s.is_slack) {
      PackedVectors v = s.v;
      s.field.dissipate(s.x, s.inverse_masses, 0.1, 0.02, v);
      EXPECT_EQ(f.norm() + (v - s.v).norm(), 0) << trace(seed) << ": slack, and yet damped";
      continue;
    }
    for (const Real time : {1e-6, 1e-2, 1e6}) {
      PackedVectors v = s.v;
      s.field.dissipate(s.x, s.inverse_masses, time, 0.02, v);
      Vector3 dp = Vector3::Zero(), dl = Vector3::Zero();
      Real before = 0, after = 0, momentum = 0, moment = 0;
      for (int i = 0; i < s.x.cols(); ++i) {
        const Real m = 1 / s.inverse_masses[i];
        const Vector3 x = s.x.col(i).head<3>(), dv = (v - s.v).col(i).head<3>();
        dp += m * dv;
        dl += m * x.cross(dv);
        before += m * s.v.col(i).squaredNorm();
        after += m * v.col(i).squaredNorm();
        momentum += m * s.v.col(i).norm();
        moment += m * x.norm() * s.v.col(i).norm();
      }
      damped += after < before * (1 - 1e-9);
      EXPECT_LE(after, before * (1 + 1e-14)) << trace(seed) << ", time " << time;
      if (!kind().conserves_momentum) continue;
      linear.see(dp.norm() / momentum, seed);
      angular.see(dl.norm() / moment, seed);
    }
  }
  EXPECT_GT(taut, static_cast<int>(num_states) / 20);
  EXPECT_GT(damped, taut);
  if (!kind().conserves_momentum) return;
  const Real tolerance = kind().has_exact_stiffness ? 1e-12 : 1e-9;
  linear.expect_below(tolerance, "linear momentum");
  angular.expect_below(tolerance, "angular momentum");
}

class DampingAlongModes : public PotentialProperties {};

TEST_P(DampingAlongModes, OverAnInstantIsTheForceOfTheDampingMatrix) {
  WorstError error;
  int damped = 0;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    PackedVectors acceleration = damping_forces(s.field, s.x, s.v, 0.1);
    for (Eigen::Index i = 0; i < s.x.cols(); ++i) acceleration.col(i) *= s.inverse_masses[i];
    if (acceleration.norm() == 0) continue;
    ++damped;
    // So short that what is of second order in it, and what is lost in digits, are each some 1e-8 of the change.
    const Real duration = 1e-8 * s.v.norm() / acceleration.norm();
    PackedVectors v = s.v;
    s.field.dissipate(s.x, s.inverse_masses, 0.1, duration, v);
    error.see(relative_error((v - s.v) / duration, acceleration), seed);
  }
  EXPECT_GT(damped, static_cast<int>(num_states) / 20);
  error.expect_below(1e-3,
                     "velocity taken in an instant");  // second order is larger where v is nearly across the gradient
}

TEST_P(PotentialProperties, EveryAccountOfTheEnergyIsTheSame) {
  WorstError error;
  for (unsigned seed = 0; seed < num_states; ++seed) {
    const State s = state(seed);
    const Real energy = s.field.energy(s.x);
    const std::vector<Real> energies = penalty::energies(s.field, s.x), strains = penalty::strains(s.field, s.x);
    const std::vector<LedgerEntry> ledger = penalty::ledger(s.field, s.x);
    ASSERT_EQ(energies.size(), 1u);
    ASSERT_EQ(ledger.size(), 1u);
    PackedVectors f = PackedVectors::Zero(4, s.x.cols());
    for (const Real other :
         {s.field.add_forces(s.x, f), energies[0], ledger[0].energy,
          s.batch->stiffness(0) / 2 * strains[0] * strains[0], particle_energies(s.field, s.x).sum()})
      error.see(std::abs(other - energy) / (energy > 0 ? energy : 1), seed);
    EXPECT_EQ(ledger[0].largest_strain, std::abs(strains[0]));
    EXPECT_EQ(ledger[0].num_enabled, 1u);
  }
  error.expect_below(1e-12, "energy");
}

TEST_P(PotentialProperties, SwitchedOffNothingIsLeft) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    State s = state(seed);
    s.batch->set_enabled(0, false);
    PackedVectors f = PackedVectors::Zero(4, s.x.cols()), v = s.v;
    EXPECT_EQ(s.field.add_forces(s.x, f), 0);
    f += damping_forces(s.field, s.x, s.v, 1);
    s.field.dissipate(s.x, s.inverse_masses, 1, 1, v);
    EXPECT_EQ(f.norm() + (v - s.v).norm(), 0);
    EXPECT_EQ(stiffness(s.field, s.x, StiffnessModel::taut).norm(), 0);
    const std::vector<LedgerEntry> ledger = penalty::ledger(s.field, s.x);
    EXPECT_EQ(ledger[0].num_enabled, 0u);
    EXPECT_EQ(ledger[0].energy, 0);
    s.batch->set_enabled(0, true);
    if (!s.is_slack) {
      EXPECT_GT(forces(s.field, s.x).norm(), 0);
    }
  }
}

TEST_P(PotentialProperties, DegeneratePositionsGiveFiniteResults) {
  const State s = state(1);
  const Eigen::Index n = s.x.cols();
  std::vector<Eigen::Matrix3Xd> cases;
  cases.push_back(Eigen::Matrix3Xd::Zero(3, n));
  cases.push_back(Eigen::Matrix3Xd::Constant(3, n, 1.5));
  for (const int kept : {1, 2}) {
    Eigen::Matrix3Xd flat = s.x.topRows<3>();
    flat.bottomRows(3 - kept).setZero();
    cases.push_back(flat);
  }
  for (const Eigen::Matrix3Xd& points : cases) {
    const PackedVectors x = pack(points);
    PackedVectors v = s.v;
    EXPECT_TRUE(std::isfinite(s.field.energy(x)));
    EXPECT_TRUE(forces(s.field, x).allFinite());
    s.field.dissipate(x, s.inverse_masses, 0.1, 0.02, v);
    EXPECT_TRUE(v.allFinite());
    for (const StiffnessModel model :
         {StiffnessModel::gauss_newton, StiffnessModel::exact, StiffnessModel::psd_projected, StiffnessModel::taut})
      EXPECT_TRUE(stiffness(s.field, x, model).allFinite());
  }
}

const auto name_of = [](const auto& tested) { return case_name(tested.param); };
INSTANTIATE_TEST_SUITE_P(All, PotentialProperties, ::testing::ValuesIn(cases()), name_of);
INSTANTIATE_TEST_SUITE_P(All, ExactStiffness, ::testing::ValuesIn(cases_where(&KindCase::has_exact_stiffness)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(All, DampingAlongModes, ::testing::ValuesIn(cases_where(&KindCase::damps_along_modes)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(All, InternalForces, ::testing::ValuesIn(cases_where(&KindCase::conserves_momentum)), name_of);

}  // namespace
}  // namespace penalty::testing
