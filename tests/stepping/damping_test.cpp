// Kelvin-Voigt damping in the step: a mode of frequency w decays at beta w²/2, whatever the mesh and the substeps.
#include <Eigen/Eigenvalues>

#include "penalty/stepping/damper.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

struct Mode {
  Real frequency;         // [rad/s]
  Eigen::VectorXd shape;  // M-orthonormal
};

// The `number` lowest modes that deform, of the particles that are not pinned.
std::vector<Mode> lowest_modes(const Body& body, int number) {
  const PotentialField& field = *body.field;
  const PackedVectors& rest = field.rest_positions();
  Eigen::MatrixXd k = assembled(field, rest, StiffnessModel::exact).to_dense();
  Eigen::VectorXd scale(k.rows());
  for (int i = 0; i < field.num_particles(); ++i)
    scale.segment<3>(3 * i).setConstant(std::sqrt(body.particles().inverse_masses[i]));
  k = scale.asDiagonal() * k * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(k);
  std::vector<Mode> modes;
  const Real largest = solver.eigenvalues().tail<1>()[0];
  for (int i = 0; i < k.rows() && static_cast<int>(modes.size()) < number; ++i)
    if (const Real value = solver.eigenvalues()[i]; value > 1e-9 * largest)
      modes.push_back({std::sqrt(value), scale.asDiagonal() * solver.eigenvectors().col(i)});
  return modes;
}

// q' q' + beta w² q q' + w² q² of the body's motion along a mode: of q'' + beta w² q' + w² q = 0 it falls as
// exp(-beta w² t) at every instant.
Real invariant(const Body& body, const Mode& mode, Real beta) {
  Real q = 0, rate = 0;
  for (int i = 0; i < body.particles().size(); ++i) {
    if (body.particles().inverse_masses[i] == 0) continue;
    const Vector3 m_shape = mode.shape.segment<3>(3 * i) / body.particles().inverse_masses[i];
    q += m_shape.dot(body.position(i) - body.field->rest_positions().col(i).head<3>());
    rate += m_shape.dot(body.velocity(i));
  }
  const Real w2 = mode.frequency * mode.frequency;
  return rate * rate + beta * w2 * q * rate + w2 * q * q;
}

// Rate of decay over beta w².
Real relative_decay(Body body, const Mode& mode, Real beta, Real duration) {
  body.body.options.damping_time = beta;
  for (int i = 0; i < body.particles().size(); ++i) body.set_velocity(i, 1e-4 * mode.shape.segment<3>(3 * i));
  const Real rate = beta * mode.frequency * mode.frequency;
  const int steps = static_cast<int>(std::ceil(std::clamp<Real>(3 / rate, 0.5, 8) / duration));
  const Real start = invariant(body, mode, beta);
  for (int step = 0; step < steps; ++step) advance(body, duration);
  return -std::log(invariant(body, mode, beta) / start) / (rate * steps * duration);
}

struct Bar {
  const char* name;
  bool clamped;
  ElasticModel model;
};

class BarDamping : public ::testing::TestWithParam<Bar> {};

TEST_P(BarDamping, OfEachOfTheFirstFiveModesIsHalfBetaOmegaSquared) {
  const auto make = [] {
    const auto& [name, clamped, model] = GetParam();
    const TetMesh mesh = make_beam(2);
    Body body = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, {.young = 1e5, .poisson = 0.35}, model),
                          std::vector<Real>(mesh.vertices.cols(), static_cast<Real>(mesh.vertices.cols()) / 4000));
    if (clamped)
      for (int i = 0; i < body.particles().size(); ++i)
        if (mesh.vertices(0, i) < mesh.vertices.row(0).minCoeff() + 1e-9) body.particles().inverse_masses[i] = 0;
    estimate_stability(body.body);
    return body;
  };
  for (const Mode& mode : lowest_modes(make(), 5))
    for (const Real share : {0.01, 0.1, 0.3, 1.0}) {
      const Real ratio = relative_decay(make(), mode, share / mode.frequency, 1.0 / 60);
      EXPECT_NEAR(ratio, 1, 0.05) << "w " << mode.frequency << ", beta w " << share;
    }
}

INSTANTIATE_TEST_SUITE_P(All, BarDamping,
                         ::testing::Values(Bar{"clamped", true, ElasticModel::springs_volumes},
                                           Bar{"free", false, ElasticModel::springs_volumes}),
                         [](const auto& bar) { return bar.param.name; });

TEST(Damping, BeyondWhatAStepCanGiveSaysHowMuchThereWas) {
  const auto share = [](Real damping_time) {
    Body bar = make_beam_body(1);
    bar.body.options.damping_time = damping_time;
    bar.set_velocity(0, {0.1, 0, 0});
    advance(bar, 1.0 / 60);
    return bar.body.report.damping_share;
  };
  EXPECT_EQ(share(0), 1);
  EXPECT_EQ(share(0.02), 1);
  const Real of_much = share(1e4), of_more = share(2e4);
  EXPECT_LT(of_much, 0.5);
  EXPECT_NEAR(of_more, of_much / 2, 1e-3 * of_much);
}

// Whoever moves the held end at V gives V times the momentum that comes in: no more can there be of energy.
TEST(Damping, TakesNoEnergyOutOfNowhereWhereAnEndIsDriven) {
  Random random(3);
  Real most_growth = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Body bar = make_beam_body(1);
    Particles& particles = bar.particles();
    const Vector3 v(30, 0, 0);
    Real kinetic = 0;
    Vector3 momentum = Vector3::Zero();
    const auto count = [&](Real sign) {
      for (int i = 0; i < particles.size(); ++i)
        if (const Real inverse_mass = particles.inverse_masses[i]; inverse_mass > 0) {
          kinetic += sign * bar.velocity(i).squaredNorm() / inverse_mass / 2;
          momentum += sign * bar.velocity(i) / inverse_mass;
        }
    };
    for (int i = 0; i < particles.size(); ++i) {
      if (bar.position(i).x() < 0.5) particles.inverse_masses[i] = 0;
      bar.set_velocity(i, particles.inverse_masses[i] == 0 ? v : random.vector(1));
    }
    Damper damper;
    damper.begin_step();
    for (int block = 0; block < 4; ++block) {  // the body is torn about within one step
      for (int i = 0; i < particles.size(); ++i) bar.set_position(i, bar.position(i) + random.vector(0.3 * block));
      kinetic = 0;
      momentum.setZero();
      count(-1);
      const Damper::Damped damped = damper.damp(*bar.field, 0.05, 1.0 / 240, particles);
      count(1);
      const Real work = v.dot(momentum);
      ASSERT_LE(kinetic, work + 1e-9 * std::abs(work)) << "trial " << trial << ", block " << block;
      EXPECT_NEAR(damped.driving_work, work, 1e-9 * std::abs(work));
      EXPECT_NEAR(damped.lost, work - kinetic, 1e-9 * std::abs(work));
      most_growth = std::max(most_growth, kinetic);
    }
  }
  EXPECT_GT(most_growth, 1) << "the end did not pull";
}

TEST(Damping, OfElementsMayBeSetLater) {
  Body bar = make_beam_body(1);
  ElementBatch& springs = bar.field->batch("length");
  springs.set_damping_time(0);
  Random random(1);
  for (int i = 0; i < bar.particles().size(); ++i) bar.set_velocity(i, random.vector(0.1));
  advance(bar, 1.0 / 60);
  EXPECT_EQ(bar.body.flows.damping, 0);
  springs.set_damping_time(0.1);
  const Real before = bar.energy();
  for (int step = 0; step < 60; ++step) advance(bar, 1.0 / 60);
  EXPECT_LT(bar.energy(), 0.5 * before);
}

}  // namespace
}  // namespace penalty::testing
