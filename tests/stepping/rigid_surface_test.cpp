// Corners and edges of rigid bodies against surfaces of soft ones: momenta in closed form, crossings by geometry.
#include <Eigen/LU>

#include "penalty/contact/surface_pair.h"
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/length.h"
#include "penalty/mesh/surface_builders.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

Eigen::Matrix3Xd corners_of_triangle() {
  Eigen::Matrix3Xd x(3, 3);
  x << -1, 1, 0, 0, 0, 0, std::sqrt(3.0) / 3, std::sqrt(3.0) / 3, -2 * std::sqrt(3.0) / 3;
  return x;
}

// A triangle of particles without forces between them and the centre of a ball.
struct TriangleAndBall {
  Real radius;
  Body triangle;
  ContactSurface under, over;
  SurfacePair pair;
  Island island;

  TriangleAndBall(Integrator integrator, Real triangle_mass, Real ball_mass, Real ball_radius, const Vector3& start,
                  const Vector3& velocity, Real friction = 0)
      : radius(ball_radius),
        triangle(make_free_particles(corners_of_triangle(), std::vector<Real>(3, triangle_mass / 3))),
        under({WeightedPoint::at_particle(0), WeightedPoint::at_particle(1), WeightedPoint::at_particle(2)},
              {{0, 1, 2}}, {}, triangle.particles().positions),
        over(std::array{Vector3(0, 0, 0)}, {{0, 0}}, ball_radius),
        pair((under.margin = over.margin = 0.05, under), over) {
    triangle.body.options.integrator = integrator;
    under.friction = 1;
    over.friction = friction;
    RigidBody ball;
    ball.position = start;
    ball.velocity = velocity;
    if (ball_mass > 0) {
      ball.inverse_mass = Vector3::Constant(1 / ball_mass);
      ball.inverse_inertia = Matrix3::Identity() / (0.4 * ball_mass * ball_radius * ball_radius);
    }
    island.bodies = {&triangle.body};
    island.rigid_bodies = {ball};
    island.surfaces = {{&pair, 0, -1, 0}};
  }
  RigidBody& ball() { return island.rigid_bodies[0]; }
  void step() { advance(island, frame); }
};

// Both integrators, and how near each comes to what is exact.
struct Way {
  Integrator integrator;
  Real tolerance;
};
constexpr Way both_ways[] = {{Integrator::explicit_step, 1e-12}, {Integrator::implicit_step, 1e-5}};

TEST(RigidSurface, ABallThatHitsTheMiddleOfATriangleStaysWithIt) {
  // 1 kg at 3 m/s and 2 kg at rest: 1 m/s together, radius and thickness apart, whichever side it comes from.
  for (const auto& [integrator, tolerance] : both_ways)
    for (const Real side : {1.0, -1.0}) {
      TriangleAndBall t(integrator, 2, 1, 0.2, {0, 2 * side, 0}, {0, -3 * side, 0});
      for (int k = 0; k < 60; ++k) t.step();
      EXPECT_LT((t.ball().velocity - Vector3(0, -side, 0)).norm(), tolerance);
      for (int i = 0; i < 3; ++i) {
        EXPECT_LT((t.triangle.velocity(i) - Vector3(0, -side, 0)).norm(), tolerance);
        EXPECT_NEAR(side * (t.ball().position.y() - t.triangle.position(i).y()), 0.25, tolerance);
      }
    }
}

TEST(RigidSurface, ABallThatSlidesOnAPinnedTriangleBeginsToRoll) {
  // A uniform ball that slides with v0 rolls with 5/7 v0, whatever the friction; it meets the plane at its thickness. The
  // impulse acts where the triangle is, as for nodes, so that angular momentum is kept: the arm is longer than the radius.
  const Real arm = 0.15 + 0.05, inertia = 0.4 * 0.15 * 0.15;
  for (const auto& [integrator, tolerance] : both_ways) {
    TriangleAndBall t(integrator, 3, 2, 0.15, {-0.5, arm, 0}, {0.5, 0, 0}, 0.3);
    t.triangle.particles().inverse_masses.assign(3, 0);
    t.ball().acceleration = {0, -10, 0};
    for (int k = 0; k < 30; ++k) t.step();
    const Real rolling = 0.5 / (1 + inertia / (arm * arm));
    EXPECT_NEAR(t.ball().velocity.x(), 0.5 - 0.5 / (1 + arm * arm / inertia), tolerance);
    EXPECT_NEAR(t.ball().velocity.x(), rolling, tolerance);
    EXPECT_NEAR(t.ball().angular_velocity.z(), -rolling / arm, 10 * tolerance);
    EXPECT_NEAR(t.ball().position.y(), arm, tolerance);
  }
}

TEST(RigidSurface, WhatMovesAndTakesNoImpulseCarriesAndItsWorkIsFromOutside) {
  TriangleAndBall t(Integrator::automatic, 2, 0, 0.2, {0, 1, 0}, {0, -1.5, 0});
  for (int k = 0; k < 60; ++k) t.step();
  for (int i = 0; i < 3; ++i) EXPECT_LT((t.triangle.velocity(i) - Vector3(0, -1.5, 0)).norm(), 1e-13);
  EXPECT_EQ(t.triangle.body.report.retries, 0) << "energy came from outside";
}

// A box that turns, thrown at a sheet which is held at its rim, or free.
struct SheetAndBox {
  TriangleSurface sheet = make_sheet(1, 1, 8, 8);
  Body cloth;
  ContactSurface surface, edges;
  SurfacePair pair;
  Island island;
  Eigen::Matrix3Xd corners = corners_of_box();

  SheetAndBox(Integrator integrator, bool held, const Vector3& velocity, const Vector3& angular_velocity)
      : cloth(make_cloth(sheet, held)),
        surface(points_of(cloth), sheet.triangles, {}, cloth.particles().positions),
        edges(make_edges()),
        pair((surface.margin = edges.margin = 0.005, surface), edges) {
    cloth.body.options.integrator = integrator;
    surface.friction = 1;
    edges.friction = 0.5;
    RigidBody box;
    box.position = {0.47, 0.53, 0.3};
    box.velocity = velocity;
    box.angular_velocity = angular_velocity;
    box.inverse_mass = Vector3::Constant(1 / 0.5);
    box.inverse_inertia = Matrix3::Identity() / (0.5 * 0.2 * 0.2 / 6);
    island.bodies = {&cloth.body};
    island.rigid_bodies = {box};
    island.surfaces = {{&pair, 0, -1, 0}};
  }

  static Body make_cloth(const TriangleSurface& sheet, bool held) {
    PotentialField field(sheet.vertices);
    field.add<Length>(edges_of(std::span<const Triangle>(sheet.triangles)), 2);
    field.add<BendingAngle>(hinges_of(sheet.triangles), 1e-5);
    std::vector<Real> inverse_masses(sheet.vertices.cols(), static_cast<Real>(sheet.vertices.cols()) / 0.3);
    for (int i = 0; held && i < sheet.vertices.cols(); ++i) {
      const auto x = sheet.vertices.col(i).head<2>().array();
      if ((x < 1e-6).any() || (x > 1 - 1e-6).any()) inverse_masses[i] = 0;
    }
    return make_body(std::move(field), inverse_masses);
  }
  static std::vector<WeightedPoint> points_of(const Body& body) {
    std::vector<WeightedPoint> points;
    points.reserve(body.particles().size());
    for (int i = 0; i < body.particles().size(); ++i) points.push_back(WeightedPoint::at_particle(i));
    return points;
  }
  static Eigen::Matrix3Xd corners_of_box() {
    Eigen::Matrix3Xd corners(3, 8);
    for (int k = 0; k < 8; ++k) corners.col(k) = 0.1 * Vector3((k & 1) ? 1 : -1, (k & 2) ? 1 : -1, (k & 4) ? 1 : -1);
    return corners;
  }
  static ContactSurface make_edges() {
    const Eigen::Matrix3Xd corners = corners_of_box();
    std::vector<Vector3> points;
    std::vector<Edge> edges;
    for (int k = 0; k < 8; ++k) {
      points.emplace_back(corners.col(k));
      for (const int axis : {1, 2, 4})
        if ((k & axis) == 0) edges.push_back({k, k | axis});
    }
    return {points, edges, 0};
  }

  // Edges of the box that go through triangles of the sheet; its nodes may go through faces of the box, which is another
  // contact's to hold.
  int crossings() const {
    const RigidBody& box = island.rigid_bodies[0];
    int count = 0;
    for (const Edge& edge : edges.edges()) {
      const Vector3 p = box.position + box.rotation * corners.col(edge[0]),
                    q = box.position + box.rotation * corners.col(edge[1]);
      for (const auto& [i, j, k] : sheet.triangles) {
        Matrix3 m;
        m << cloth.position(j) - cloth.position(i), cloth.position(k) - cloth.position(i), p - q;
        const Vector3 at = m.inverse() * (p - cloth.position(i));  // barycentric, and along the edge
        if (at.allFinite() && at.minCoeff() > 1e-9 && at.head<2>().sum() < 1 - 1e-9 && at[2] < 1 - 1e-9) ++count;
      }
    }
    return count;
  }
  Real energy() const {
    return kinetic_energy(cloth.particles()) + cloth.field->energy(cloth.particles().positions) +
           kinetic_energy(island.rigid_bodies[0]);
  }
  Momentum momentum() const { return testing::momentum({&cloth}, island.rigid_bodies); }
};

TEST(RigidSurface, ATurningBoxDoesNotPassASheet) {
  for (const Way& way : both_ways)
    for (const bool held : {false, true})
      for (const Real speed : {2.0, 20.0, 50.0})
        for (const Real spin : {0.0, 30.0, 150.0}) {
          SCOPED_TRACE(::testing::Message()
                       << (way.tolerance > 1e-6 ? "implicit" : "explicit") << (held ? ", held" : ", free") << ", "
                       << speed << " m/s, " << spin << " rad/s");
          SheetAndBox s(way.integrator, held, {0, 0, -speed}, spin * Vector3(1, 0.7, 0.3).normalized());
          const int frames = 10 + static_cast<int>(0.3 / speed / frame);
          const Momentum before = s.momentum();
          const Real start = s.energy();
          Real highest = start;
          for (int k = 0; k < frames; ++k) {
            advance(s.island, frame);
            ASSERT_EQ(s.crossings(), 0) << "frame " << k;
            highest = std::max(highest, s.energy());
          }
          EXPECT_LT(s.energy(), start) << "did not hit";
          EXPECT_LE(highest, start * (1 + 1e-12));
          if (held) continue;
          const Momentum after = s.momentum();
          EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * 0.5 * speed);
          EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * (0.5 * speed + 0.01 * spin));
        }
}

}  // namespace
}  // namespace penalty::testing
