// Kelvin-Voigt damping in the step: a mode of frequency w decays at beta w²/2, whatever the mesh and the substeps.
#include <Eigen/Eigenvalues>
#include <numbers>

#include "stepping/surface_bodies.h"

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

// The largest speed of a particle over a step, from positions: what is seen to move.
Real largest_motion(SurfaceBodies& bodies, int count) {
  std::vector<PackedVectors> before;
  before.reserve(count);
  for (int k = 0; k < count; ++k) before.push_back(bodies[k].particles().positions);
  bodies.step();
  Real largest = 0;
  for (int k = 0; k < count; ++k)
    largest = std::max(largest, (bodies[k].particles().positions - before[k]).colwise().norm().maxCoeff() * 60);
  return largest;
}

Real largest_speed(SurfaceBodies& bodies, int count) {
  Real largest = 0;
  for (int k = 0; k < count; ++k)
    largest = std::max(largest, bodies[k].particles().velocities.colwise().norm().maxCoeff());
  return largest;
}

// Stands on a floor of friction, under gravity of the earth.
SurfaceBodies standing(Real size, Real damping_time) {
  SurfaceBodies bodies;
  bodies.margin = 0.01 * size;
  bodies.friction = 0.6;
  bodies.gravity = {0, -9.81, 0};
  bodies.floors = {0};
  bodies.damping_time = damping_time;
  return bodies;
}

TEST(Settling, OfATowerThatSwaysTakesThreeSeconds) {
  for (const Real size : {0.01, 1.0, 100.0}) {
    SCOPED_TRACE("size " + std::to_string(size));
    const Real slowness = std::sqrt(size);  // of what gravity makes of it
    SurfaceBodies bodies = standing(size, 0.02 * slowness);
    const Real mass = 300 * size * size * size;
    const TetMesh mesh = make_box({size, 3 * size, size}, {3, 9, 3});
    Body& tower = bodies.add(mesh, 0.5 * 9.81 * size * mass, mass, {.shift = {0, 0.005 * size, 0}});
    for (int i = 0; i < tower.particles().size(); ++i)
      tower.set_velocity(i, {slowness * mesh.vertices(1, i) / (3 * size), 0, 0});
    const int steps = static_cast<int>(180 * std::max<Real>(slowness, 1));
    bodies.step(1.0 / 60, steps);
    EXPECT_LT(largest_motion(bodies, 1), 0.005 * slowness);
    bodies.step(1.0 / 60, steps);
    EXPECT_LT(largest_motion(bodies, 1), 0.001 * slowness);
    EXPECT_LT(largest_speed(bodies, 1), 0.001 * slowness);
  }
}

TEST(Settling, OfThreeBoxesOnEachOtherTakesThreeSeconds) {
  SurfaceBodies bodies = standing(1, 0.02);
  for (int k = 0; k < 3; ++k) bodies.add(make_box({1, 1, 1}, {3, 3, 3}), 100, 10, {.shift = {0, 0.02 + 1.03 * k, 0}});
  bodies.step(1.0 / 60, 180);
  EXPECT_LT(largest_motion(bodies, 3), 0.005);
  bodies.step(1.0 / 60, 180);
  EXPECT_LT(largest_motion(bodies, 3), 0.001);
  EXPECT_LT(largest_speed(bodies, 3), 0.001);
}

TEST(Settling, LetsACubeBounceToAThirdOfItsFall) {
  SurfaceBodies bodies = standing(1, 0.005);
  Body& cube = bodies.add(make_box({1, 1, 1}, {4, 4, 4}), 1000, 10, {.shift = {0, 0.505, 0}});
  Real highest = 0;
  for (int k = 0; k < 60; ++k) {
    bodies.step();
    if (k > 30) highest = std::max(highest, cube.particles().positions.row(1).minCoeff() - bodies.margin / 2);
  }
  EXPECT_GT(highest, 0.5 / 3);
  EXPECT_LT(highest, 0.5);
}

TEST(Settling, LeavesWhatSlidesAlone) {
  // Down a slope of 3 degrees without friction, in its frame.
  SurfaceBodies bodies = standing(1, 0.02);
  bodies.friction = 0;
  const Real slope = 3 * std::numbers::pi / 180;
  bodies.gravity = 9.81 * Vector3(std::sin(slope), -std::cos(slope), 0);
  Body& cube = bodies.add(make_box({1, 1, 1}, {3, 3, 3}), 100, 10, {.shift = {0, 0.005, 0}});
  bodies.step(1.0 / 60, 120);
  const Vector3 mean = cube.particles().velocities.rowwise().mean().head<3>();
  EXPECT_NEAR(mean.x(), 2 * bodies.gravity.x(), 1e-9);
}

}  // namespace
}  // namespace penalty::testing
