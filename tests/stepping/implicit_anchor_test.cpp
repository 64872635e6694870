// Anchors in the implicit step: measured from positions and velocities alone.
#include "penalty/mesh/builders.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

/// A box of jelly from (0, 0, 0) to (0.6, 0.4, 0.6) and a rigid body above it that some of its particles are anchored to.
struct AnchoredBox {
  Body body;
  Island island;

  AnchoredBox(Real stiffness, const RigidBody& rigid, const auto& holds) : body(make(stiffness)) {
    body.body.options.integrator = Integrator::implicit_step;
    island.bodies = {&body.body};
    island.rigid_bodies = {rigid};
    for (int i = 0; i < body.particles().size(); ++i)
      if (holds(body.position(i)))
        island.anchors.push_back(
            {.a = Side::of_particles(0, WeightedPoint::at_particle(i)),
             .b = Side::of_rigid(0, rigid.rotation.transpose() * (body.position(i) - rigid.position))});
  }
  static Body make(Real stiffness) {
    const TetMesh mesh = make_box({0.6, 0.4, 0.6}, {3, 2, 3});
    return make_body(make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = stiffness}),
                     std::vector<Real>(mesh.vertices.cols(), Real(mesh.vertices.cols()) / 2));
  }

  RigidBody& rigid() { return island.rigid_bodies[0]; }
  void step() { advance(island, frame); }
  Real gap() const {
    Real most = 0;
    for (const Anchor& anchor : island.anchors) {
      const RigidBody& to = island.rigid_bodies[0];
      const Vector3 at = to.position + to.rotation * anchor.b.anchor;
      most = std::max(most, (body.position(anchor.a.point.particles[0]) - at).norm());
    }
    return most;
  }
  Momentum momentum() const { return testing::momentum({&body}, island.rigid_bodies); }
  Real height() const { return body.particles().positions.row(1).mean(); }
  Real energy() const {
    Real sum = body.energy();
    sum -= body.body.gravity.dot(2 * Vector3(body.particles().positions.rowwise().mean().head<3>()));
    for (const RigidBody& to : island.rigid_bodies) {
      sum += kinetic_energy(to);
      if (to.is_dynamic()) sum -= to.acceleration.dot(to.position) / to.inverse_mass.x();
    }
    return sum;
  }
};

constexpr auto at_top = [](const Vector3& x) { return x.y() > 0.39; };
constexpr auto at_two_corners = [](const Vector3& x) {
  return x.y() > 0.39 && x.z() < 0.01 && std::abs(x.x() - 0.3) > 0.2;
};

TEST(ImplicitAnchor, ToAStaticBodyHoldsABodyThatHangs) {
  for (const Real young : {1e4, 1e6, 1e8})
    for (const bool many : {false, true}) {
      SCOPED_TRACE(young);
      const RigidBody beam;
      AnchoredBox s = many ? AnchoredBox(young, beam, at_top) : AnchoredBox(young, beam, at_two_corners);
      s.body.body.gravity = {0, -g, 0};
      s.step();
      Real last = s.energy();
      for (int k = 0; k < 240; ++k) {
        s.step();
        ASSERT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
        ASSERT_LT(s.gap(), 1e-4) << "frame " << k;
        ASSERT_LE(s.energy(), last + 1e-6) << "frame " << k;
        last = s.energy();
      }
      if (many) {
        EXPECT_LT(kinetic_energy(s.body.particles()), 1e-9);
      }
    }
}

TEST(ImplicitAnchor, ToAFreeBodyKeepsMomentaAndEnergy) {
  for (const Real mass : {0.01, 1.0, 100.0})
    for (const bool many : {false, true}) {
      SCOPED_TRACE(mass);
      RigidBody ball = make_sphere(mass, 0.1, {0.3, 0.6, 0.1});
      AnchoredBox s = many ? AnchoredBox(1e5, ball, at_top) : AnchoredBox(1e5, ball, at_two_corners);
      for (int i = 0; i < s.body.particles().size(); ++i) s.body.set_velocity(i, {1, 2, -1});
      const Momentum before = s.momentum();
      const Real start = kinetic_energy(s.body.particles());
      const Real scale = 2 * std::sqrt(6.0);
      for (int k = 0; k < 120; ++k) {
        s.step();
        ASSERT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
        ASSERT_LT(s.gap(), 1e-3) << "frame " << k;
        ASSERT_LE(s.energy(), start) << "frame " << k;
      }
      EXPECT_LT((s.momentum().linear - before.linear).norm(), 1e-12 * scale);
      EXPECT_LT((s.momentum().angular - before.angular).norm(), 1e-12 * scale);
      EXPECT_GT(s.rigid().velocity.norm(), 0.01) << "is not taken along";
    }
}

TEST(ImplicitAnchor, CarriesAWeight) {
  // Below a body that is pinned at its top; the anchors give the weight, whatever it is.
  for (const Real mass : {0.1, 10.0, 1000.0}) {
    SCOPED_TRACE(mass);
    RigidBody weight = make_sphere(mass, 0.1, {0.3, -0.1, 0.3});
    weight.acceleration = {0, -g, 0};
    AnchoredBox s(1e7, weight, [](const Vector3& x) { return x.y() < 0.01; });
    for (int i = 0; i < s.body.particles().size(); ++i)
      if (at_top(s.body.position(i))) s.body.particles().inverse_masses[i] = 0;
    estimate_stability(s.body.body);
    for (int k = 0; k < 240; ++k) {
      s.step();
      ASSERT_LT(s.gap(), 1e-4) << "frame " << k;
    }
    EXPECT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
    EXPECT_LT(s.rigid().velocity.norm(), 1e-4);
    Vector3 holding = Vector3::Zero();
    for (int i = 0; i < s.body.particles().size(); ++i)
      if (s.body.particles().inverse_masses[i] == 0) holding -= s.body.body.forces.col(i).head<3>();
    EXPECT_NEAR(holding.y(), mass * g, 1e-3 * mass * g);
  }
}

TEST(ImplicitAnchor, FollowsABodyThatIsDriven) {
  RigidBody hand;
  hand.position = {0.3, 0.5, 0};
  AnchoredBox s(1e6, hand, at_two_corners);
  for (int k = 1; k <= 120; ++k) {
    s.rigid().velocity = {0.5, 0.2, 0};
    s.rigid().angular_velocity = {0, 1, 0};
    s.step();
    ASSERT_EQ(s.body.body.report.integrator, Integrator::implicit_step);
    ASSERT_LT(s.gap(), 1e-3) << "frame " << k;
  }
  EXPECT_GT(s.height(), 0.4);
  s.island.anchors.front().influence = 0.5;
  s.step();
  EXPECT_EQ(s.body.body.report.integrator, Integrator::explicit_step) << "what gives way is left to the substeps";
}

}  // namespace
}  // namespace penalty::testing
