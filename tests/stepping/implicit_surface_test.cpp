// What an implicit step does where surfaces meet corners, edges and themselves: weights, depths and crossings by geometry.
#include "penalty/mesh/builders.h"
#include "penalty/mesh/surface_builders.h"
#include "stepping/surface_bodies.h"

namespace penalty::testing {
namespace {

constexpr Real implicit_gravity = 9.81;  // [m/s²]

TEST(ImplicitSurface, AClothFallsIntoFoldsAndLiesStillWithoutCrossingItself) {
  std::vector<Real> least;  // of each way to fall, in order: how cloth folds is chaotic
  for (const Real angle : {0.049, 0.05, 0.052}) {
    SCOPED_TRACE(angle);
    SurfaceBodies bodies;
    bodies.integrator = Integrator::implicit_step;
    bodies.margin = 0.015;
    bodies.friction = 0.5;
    bodies.damping_time = 0.005;
    bodies.gravity = {0, -implicit_gravity, 0};
    bodies.floors = {0};
    bodies.add_cloth(make_sheet(1, 1, 12, 12), 0.1, 2e-5, 0.3,
                     {.shift = {0, 0.02, 0}, .rotation = Eigen::AngleAxis<Real>(angle, Vector3::UnitX()).matrix()});
    const Real start = bodies.energy();
    Real highest = start;
    least.push_back(1);
    int steps_in_contact = 0;
    for (int k = 0; k < 120; ++k) {
      bodies.step();
      ASSERT_EQ(bodies.crossings(), 0) << "frame " << k;
      ASSERT_EQ(bodies[0].body.report.integrator, Integrator::implicit_step);
      highest = std::max(highest, bodies.energy());
      least.back() = std::min(least.back(), least_distance(bodies.skins(), true) / bodies.margin);
      steps_in_contact += bodies[0].body.report.num_contacts > 0;
    }
    EXPECT_GT(steps_in_contact, 60);
    EXPECT_LE(highest, start);
    EXPECT_LT(bodies.energy(), 0.5 * start) << "did not fall";
    EXPECT_LT(bodies.kinetic_energy(), 1e-9);
  }
  std::ranges::sort(least);
  EXPECT_GT(least[0], 0.05);
  EXPECT_GT(least[1], 0.25) << "planes alone leave a tenth of what was";
}

// The centre of a ball on the surface of a box of soft matter, whose triangles are larger than the ball.
struct BoxAndBall {
  Real duration;  // of a step: as if all happened at the same scale [s]
  TetMesh mesh = make_box({1, 0.5, 1}, {2, 1, 2});
  Body body;
  std::vector<Triangle> triangles = boundary_faces(mesh.tetrahedra);
  std::unique_ptr<ContactSurface> under, over;
  std::unique_ptr<SurfacePair> pair;
  Island island;

  BoxAndBall(Real radius, Real mass, const Vector3& start, Real size = 1) : duration(frame * std::sqrt(size)) {
    mesh.vertices *= size;
    const auto count = static_cast<std::size_t>(mesh.vertices.cols());
    std::vector<Real> inverse_masses(count, static_cast<Real>(count) / 5);
    for (std::size_t i = 0; i < count; ++i)
      if (mesh.vertices(1, static_cast<Eigen::Index>(i)) < 1e-9 * size) inverse_masses[i] = 0;
    body = make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, 1e4 * size), inverse_masses);
    body.body.options.integrator = Integrator::implicit_step;
    body.body.options.damping_time = 0.01 * std::sqrt(size);
    body.body.gravity = {0, -implicit_gravity, 0};
    std::vector<WeightedPoint> points;
    points.reserve(count);
    for (int i = 0; i < body.particles().size(); ++i) points.push_back(WeightedPoint::at_particle(i));
    under = std::make_unique<ContactSurface>(points, triangles, std::vector<Edge>{}, pack(mesh.vertices));
    over = std::make_unique<ContactSurface>(std::array{Vector3(0, 0, 0)}, std::vector<Edge>{{0, 0}}, radius);
    under->margin = over->margin = radius / 5;
    under->friction = 1;
    over->friction = 0.5;
    pair = std::make_unique<SurfacePair>(*under, *over);
    island.rigid_bodies = {make_sphere(mass, radius, start)};
    island.surfaces = {{pair.get(), 0, -1, 0}};
    ball().acceleration = {0, -implicit_gravity, 0};
  }
  RigidBody& ball() { return island.rigid_bodies[0]; }
  void step() {
    island.bodies = {&body.body};
    advance(island, duration);
  }
  Real distance() const {  // of the centre of the ball from the surface
    Real least = std::numeric_limits<Real>::infinity();
    for (const auto& [i, j, k] : triangles)
      least = std::min(least, closest_points_of_triangle(island.rigid_bodies[0].position, body.position(i),
                                                         body.position(j), body.position(k))
                                  .difference.norm());
    return least;
  }
};

TEST(ImplicitSurface, ABallSmallerThanATriangleLiesOnItWithItsWeight) {
  for (const Real size : {0.01, 1.0, 100.0})
    for (const Real mass : {1e-3, 1.0, 10.0}) {
      SCOPED_TRACE("size " + std::to_string(size) + ", mass " + std::to_string(mass));
      const Real radius = 0.05 * size;
      BoxAndBall s(radius, mass, size * Vector3(0.6, 0.62, 0.7), size);
      Real least = std::numeric_limits<Real>::infinity();
      for (int k = 0; k < 300; ++k) {
        s.step();
        ASSERT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
        least = std::min(least, s.distance());
      }
      EXPECT_GT(least, radius);
      EXPECT_NEAR(s.distance(), 1.2 * radius, 0.01 * radius);
      Vector3 given = Vector3::Zero();
      for (const ContactRecord& record : s.island.records) given += record.impulse;
      const Real weight = mass * implicit_gravity;
      EXPECT_NEAR(-given.y() / s.duration, weight, 1e-3 * weight);
      EXPECT_LT(std::abs(s.ball().velocity.y()), 1e-4 * std::sqrt(implicit_gravity * size));
    }
}

TEST(ImplicitSurface, AutomaticLeavesTheHitToSubstepsAndTakesWhatLies) {
  BoxAndBall s(0.05, 1, {0.5, 0.57, 0.45});
  s.body.body.options.integrator = Integrator::automatic;
  s.body.body.largest_eigenvalue = 1e9;  // as if it were that stiff
  s.body.body.options.max_substeps = 1000;
  s.ball().velocity.y() = -2;
  s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::explicit_step);
  EXPECT_GT(s.ball().velocity.y(), -1) << "has not hit";
  for (int k = 0; k < 200; ++k) s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
  EXPECT_GT(s.body.body.report.num_contacts, 0);
}

TEST(ImplicitSurface, WhatIsHeldAndMovesIsLeftToTheSubsteps) {
  BoxAndBall s(0.05, 1, {0.6, 0.562, 0.7});
  s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
  s.ball().angular_velocity = {0, 60, 0};
  s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::explicit_step) << "it spins";
  s.ball().angular_velocity.setZero();
  s.ball().inverse_mass.setZero();
  s.ball().inverse_inertia.setZero();
  s.ball().velocity = {0, -0.1, 0};
  s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::explicit_step) << "the ball is driven";
}

}  // namespace
}  // namespace penalty::testing
