// Bodies that fall, lie, carry and slide.
#include <cmath>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Real margin = 0.02;

class Ground : public WorldTest {
 protected:
  void SetUp() override { sim.set_gravity({0, -9.81, 0}); }

  Real center_y(const btSoftBody& body) { return center_of_mass(sim.penalty().particles(body)).y(); }
  Real speed(const btSoftBody& body) {
    const Particles& p = sim.penalty().particles(body);
    Real mass = 0;
    for (const Real inverse_mass : p.inverse_masses) mass += 1 / inverse_mass;
    return std::sqrt(2 * kinetic_energy(p) / mass);
  }
};

// A torus of 1 kg and 2 m across falls 2 m: 20 J.
class TorusDrop : public Ground {
 protected:
  void drop(Real stiffness, Real largest_volume_error) {
    sim.add_ground();
    const TetMesh torus = make_torus();
    btSoftBody& body = sim.add_jelly(torus, {.stiffness = stiffness,
                                             .shift = {0, 2 - torus.vertices.row(1).minCoeff(), 0},
                                             .attach = {.step = {.damping_time = 0.002}}});
    Real peak = 0, gain = 0, depth = 0, energy = sim.totals().energy;
    for (int k = 0; k < 180; ++k) {
      sim.step(frame);
      ASSERT_TRUE(sim.penalty().report(body).finite) << "step " << k;
      const Real now = sim.totals().energy;
      gain = std::max(gain, now - energy);
      energy = now;
      peak = std::max(peak, mean_volume_error(sim.penalty(), body));
      depth = std::max(depth, margin - lowest(body));
    }
    RecordProperty("peak_volume_error", std::to_string(peak));
    RecordProperty("largest_gain", std::to_string(gain * 1e6) + " uJ");
    RecordProperty("depth", std::to_string(depth * 1e6) + " um");
    EXPECT_GT(peak, largest_volume_error / 20) << "did not hit the ground";
    EXPECT_LE(peak, largest_volume_error);
    EXPECT_LE(gain, 0.01);
    EXPECT_LT(depth, margin) << "a node went through the surface";
    sim.step(frame, 60);
    EXPECT_LT(speed(body), 0.05) << "came to rest";
    EXPECT_LT(mean_volume_error(sim.penalty(), body), largest_volume_error / 3);
  }
};

TEST_P(TorusDrop, SoftKeepsItsVolume) { drop(1, 0.03); }
TEST_P(TorusDrop, StiffKeepsItsVolume) { drop(10, 0.006); }
INSTANTIATE_TEST_SUITE_P(World, TorusDrop, both_worlds(), param_name);

TEST_P(Ground, AHeavyBoxPressesTheTorusAndComesToRestOnIt) {
  sim.add_ground();
  const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
  btSoftBody& body = sim.add_jelly(
      torus, {.shift = {0, 0.022 - torus.vertices.row(1).minCoeff(), 0}, .attach = {.step = {.damping_time = 0.002}}});
  btRigidBody& box = sim.add_box({0.6, 0.15, 0.6}, 10, {0, 0.622 + 0.3 + 0.15, 0});
  Real peak = 0, early = 0, late = 0;  // speeds of the second and the last second: it bounces softly
  for (int k = 0; k < 720; ++k) {
    sim.step(frame);
    peak = std::max(peak, mean_volume_error(sim.penalty(), body));
    if (k >= 60 && k < 120) early = std::max(early, Real(box.getLinearVelocity().length()));
    if (k >= 660) late = std::max(late, Real(box.getLinearVelocity().length()));
  }
  const Real y = Real(box.getWorldTransform().getOrigin().y());
  RecordProperty("box_y", std::to_string(y));
  RecordProperty("peak_volume_error", std::to_string(peak));
  EXPECT_GT(y, 0.55);
  EXPECT_LT(y, 0.8);
  RecordProperty("speeds", std::to_string(early) + " " + std::to_string(late));
  EXPECT_LT(late, 0.15 * early);
  EXPECT_LT(peak, 0.05);
  EXPECT_LT(mean_volume_error(sim.penalty(), body), 0.02);
  EXPECT_GT(lowest(body), 0);
}

TEST_P(Ground, ATorusOnABoxOnTheGroundLeavesTheBoxAtRest) {
  sim.add_ground();
  const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
  btSoftBody& body = sim.add_jelly(
      torus, {.shift = {0, 0.422 - torus.vertices.row(1).minCoeff(), 0}, .attach = {.step = {.damping_time = 0.002}}});
  btRigidBody& box = sim.add_box({1.2, 0.2, 1.2}, 5, {0, 0.2, 0});
  sim.step(frame, 180);
  Real largest_speed = 0, largest_offset = 0;
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    largest_speed = std::max(largest_speed, Real(box.getLinearVelocity().length()));
    largest_offset = std::max(largest_offset, std::abs(Real(box.getWorldTransform().getOrigin().y()) - 0.2));
  }
  RecordProperty("box_speed", std::to_string(largest_speed));
  RecordProperty("box_offset", std::to_string(largest_offset));
  EXPECT_LT(largest_speed, 5e-3);
  EXPECT_LT(largest_offset, 2e-3);
  EXPECT_LT(speed(body), 0.02);
}

// A cube on a slope of 20 degrees, of friction mu: tan 20 = 0.364.
class Slope : public Ground {
 protected:
  // Displacement down the slope and speed along it after each frame.
  std::vector<Vector3> slide(Real friction, int steps) {
    sim.set_gravity(9.81 * Vector3(std::sin(angle), -std::cos(angle), 0));  // the same as tilting the ground
    sim.add_ground(friction);
    const TetMesh cube = make_box({0.5, 0.25, 0.5}, {4, 2, 4});
    btSoftBody& body = sim.add_jelly(cube, {.shift = {0, margin, 0}, .attach = {.step = {.damping_time = 0.002}}});
    std::vector<Vector3> centers{center_of_mass(sim.penalty().particles(body))};
    for (int k = 0; k < steps; ++k) {
      sim.step(frame);
      centers.push_back(center_of_mass(sim.penalty().particles(body)));
    }
    return centers;
  }

  const Real angle = 20 * 3.14159265358979 / 180;
};

TEST_P(Slope, FrictionAboveTheTangentHolds) {
  const std::vector<Vector3> x = slide(0.6, 120);
  RecordProperty("slide_mm", std::to_string((x.back() - x.front()).x() * 1e3));
  EXPECT_LT((x[120] - x[0]).norm(), 0.02) << "but for settling";
  EXPECT_LT((x[120] - x[60]).norm(), 1e-3);
}

TEST_P(Slope, FrictionBelowTheTangentSlidesAsCoulombSays) {
  const std::vector<Vector3> x = slide(0.2, 120);
  const Real acceleration = 9.81 * (std::sin(angle) - 0.2 * std::cos(angle));
  // Over the second second, from the positions at its start, middle and end.
  const Real measured = (x[120] - 2 * x[90] + x[60]).x() / 0.25;
  RecordProperty("acceleration_ratio", std::to_string(measured / acceleration));
  EXPECT_NEAR(measured, acceleration, 0.03 * acceleration);
  EXPECT_LT(std::abs(x[120].z() - x[0].z()), 0.01);
}
INSTANTIATE_TEST_SUITE_P(World, Slope, both_worlds(), param_name);

TEST_P(Ground, AKinematicBoxPushesAtItsOwnSpeed) {
  sim.set_gravity({0, 0, 0});
  btSoftBody& body = sim.add_jelly(make_ball(0.3, 2), {.attach = {.step = {.damping_time = 0.01}}});
  btRigidBody& box = sim.add_box({0.1, 0.5, 0.5}, 0, {-0.6, 0, 0});
  box.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  const Real pace = 1;
  for (int k = 0; k < 90; ++k) {
    btTransform transform = box.getWorldTransform();
    transform.setOrigin(transform.getOrigin() + btVector3(static_cast<btScalar>(pace * frame), 0, 0));
    box.setWorldTransform(transform);
    sim.step(frame);
  }
  const Particles& p = sim.penalty().particles(body);
  const Real velocity = linear_momentum(p).x();  // of 1 kg
  EXPECT_GT(velocity, 0.95 * pace);
  EXPECT_LT(velocity, 2.05 * pace) << "no more than an elastic push";
  const Real face = Real(box.getWorldTransform().getOrigin().x()) + 0.1;
  EXPECT_GT(p.positions.row(0).minCoeff(), face);
}

TEST_P(Ground, OnlyContactPointsTouchIfTheyAreGiven) {
  sim.add_ground();
  const TetMesh box = make_box({0.4, 0.4, 0.4}, {2, 2, 2});
  // The middle of the upper face of the box only: the body hangs by it, below the ground.
  int top = -1;
  for (int i = 0; i < box.vertices.cols(); ++i)
    if ((box.vertices.col(i) - Vector3(0.2, 0.4, 0.2)).norm() < 1e-9) top = i;
  ASSERT_GE(top, 0);
  AttachOptions attach;
  attach.contact_points = {WeightedPoint::at_particle(top)};
  attach.step.damping_time = 0.01;
  btSoftBody& body = sim.add_jelly(box, {.stiffness = 50, .shift = {0, 0.1, 0}, .attach = attach});
  sim.step(frame, 180);
  EXPECT_NEAR(sim.penalty().particles(body).positions(1, top), margin, 0.005);
  EXPECT_LT(lowest(body), -0.3);
}

INSTANTIATE_TEST_SUITE_P(World, Ground, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
