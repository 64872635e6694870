// Joints between rigid bodies of an island, in closed form. A particle far away makes it an island.
#include <numbers>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

constexpr Real unlimited = JointRow::unlimited;

// Balls and axles, by where they are in the frames of their bodies.
class Joints final : public JointSource {
 public:
  struct Kind {
    int a, b;
    Vector3 at_a, at_b;                                          // [m]
    Vector3 axis_a = Vector3::Zero(), axis_b = Vector3::Zero();  // zero: a ball
    Real speed = 0, torque = 0;                                  // of a motor about the axis of a [rad/s], [N m]
    Real most_angle = unlimited;                                 // of a about its axis against b
    Real stiffness = 0;                                          // instead of a ball: a spring along y [N/m]
  };
  std::vector<Kind> kinds;

  void add_rows(std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows) override {
    for (std::size_t k = 0; k < kinds.size(); ++k) add(kinds[k], static_cast<int>(k), bodies, h, since, rows);
  }

 private:
  static void add(const Kind& kind, int joint, std::span<const RigidBody> bodies, Real h, Real since,
                  std::vector<JointRow>& rows) {
    const RigidBody& a = bodies[kind.a];
    const RigidBody world, &b = kind.b < 0 ? world : bodies[kind.b];
    const Vector3 on_a = a.position + a.rotation * kind.at_a, on_b = b.position + b.rotation * kind.at_b;
    const Vector3 at = (on_a + on_b) / 2;
    int number = 0;
    const auto row = [&](const Vector3& linear, const Vector3& angular_a, const Vector3& angular_b) -> JointRow& {
      rows.push_back({.joint = joint,
                      .number = number++,
                      .linear_a = linear,
                      .angular_a = angular_a,
                      .linear_b = -linear,
                      .angular_b = angular_b});
      return rows.back();
    };
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 n = Vector3::Unit(axis);
      const Vector3 turn_a = (at - a.position).cross(n), turn_b = -(at - b.position).cross(n);
      JointRow& line = row(n, turn_a, turn_b);
      if (kind.stiffness == 0)
        line.recovery = -n.dot(on_a - on_b) / h;
      else if (axis == 1)
        line.least = line.most = -kind.stiffness * since * n.dot(on_a - on_b);
      else
        line.least = line.most = 0;
    }
    if (kind.axis_a.isZero(0)) return;
    const Vector3 axis_a = a.rotation * kind.axis_a, axis_b = b.rotation * kind.axis_b;
    for (const Vector3& side : {axis_b.unitOrthogonal(), Vector3(axis_b.cross(axis_b.unitOrthogonal()))})
      row(Vector3::Zero(), side, -side).recovery = side.dot(axis_a.cross(axis_b)) / h;
    if (kind.torque > 0) {
      JointRow& motor = row(Vector3::Zero(), axis_b, -axis_b);
      motor.wanted = kind.speed;
      motor.most = kind.torque * since;
      motor.least = -motor.most;
    }
    if (kind.most_angle < unlimited) {
      const Eigen::AngleAxis<Real> turned(Matrix3(b.rotation.transpose() * a.rotation));
      const Real angle = turned.angle() * turned.axis().dot(kind.axis_b);
      if (angle <= kind.most_angle) return;
      JointRow& stop = row(Vector3::Zero(), axis_b, -axis_b);
      stop.most = 0;
      stop.recovery = (kind.most_angle - angle) / h;
    }
  }
};

struct JointedIsland {
  Body particle = make_free_particles(Eigen::Matrix3Xd(Vector3(100, 0, 0)), {1});
  Joints joints;
  Island island;

  JointedIsland() {
    island.bodies = {&particle.body};
    island.joint_source = &joints;
  }
  RigidBody& operator[](std::size_t k) { return island.rigid_bodies[k]; }
  Joint& add(const Joints::Kind& kind) {
    joints.kinds.push_back(kind);
    return island.joints.emplace_back(Joint{.a = kind.a, .b = kind.b});
  }
  // A ball at `point`, which both bodies have there now.
  Joint& add_ball(int a, int b, const Vector3& point) {
    return add({.a = a, .b = b, .at_a = local(a, point), .at_b = local(b, point)});
  }
  Vector3 local(int body, const Vector3& point) const {
    if (body < 0) return point;
    const RigidBody& rigid = island.rigid_bodies[body];
    return rigid.rotation.transpose() * (point - rigid.position);
  }
  Vector3 at(int body, const Vector3& local) const {
    const RigidBody& rigid = island.rigid_bodies[body];
    return rigid.position + rigid.rotation * local;
  }
  Real gap(std::size_t k) const {
    const Joints::Kind& kind = joints.kinds[k];
    return (at(kind.a, kind.at_a) - (kind.b < 0 ? kind.at_b : at(kind.b, kind.at_b))).norm();
  }
  Real energy() const {
    Real sum = 0;
    for (const RigidBody& body : island.rigid_bodies)
      if (body.is_dynamic()) sum += kinetic_energy(body) - body.acceleration.dot(body.position) / body.inverse_mass.x();
    return sum;
  }
  StepReport step(int count = 1) {
    StepReport report;
    for (int k = 0; k < count; ++k) report = advance(island, frame);
    return report;
  }
};

RigidBody falling_ball(Real mass, const Vector3& position) {
  RigidBody body = make_sphere(mass, 0.3, position);
  body.acceleration = Vector3(0, -g, 0);
  return body;
}

TEST(Joint, APendulumSwingsInItsPeriodAndKeepsItsEnergy) {
  JointedIsland s;
  const Real length = 1, tilt = 0.05, radius = 0.3;
  s.island.rigid_bodies = {falling_ball(2, {length * std::sin(tilt), -length * std::cos(tilt), 0})};
  s.particle.body.options.substeps = 20;
  s.add_ball(0, -1, Vector3::Zero());
  const Real start = s.energy(), swing = 2 * g * length * (1 - std::cos(tilt));
  const Real rate = std::sqrt(g * length / (length * length + 0.4 * radius * radius)) * (1 - tilt * tilt / 16);
  for (int k = 1; k <= 600; ++k) {
    s.step();
    EXPECT_NEAR(s[0].position.x(), tilt * length * std::cos(rate * k * frame), 2e-3 * tilt) << k;
    EXPECT_NEAR(s.energy(), start, 1e-4 * swing) << k;
    EXPECT_LT(s.gap(0), 1e-8) << k;
  }
}

// As fast as it turns, as many substeps are taken: it stays on its circle.
TEST(Joint, AFastOneStaysWhereItIsHeld) {
  for (const Real rate : {5.0, 20.0, 60.0}) {
    SCOPED_TRACE(rate);
    JointedIsland s;
    s.island.rigid_bodies = {make_sphere(2, 0.3, {1, 0, 0})};
    s[0].angular_velocity = Vector3(0, 0, rate);
    s[0].velocity = Vector3(0, rate, 0);
    s.add_ball(0, -1, Vector3::Zero());
    for (int k = 0; k < 120; ++k) {
      s.step();
      EXPECT_LT(s.gap(0), 3e-4) << k;
      EXPECT_NEAR(s[0].velocity.norm(), rate, 1e-3 * rate) << k;
    }
  }
}

TEST(Joint, AFreePairKeepsBothMomenta) {
  JointedIsland s;
  s.island.rigid_bodies = {make_sphere(2, 0.3, {0, 0, 0}), make_sphere(0.1, 0.5, {1, 0.2, 0})};
  s[0].velocity = Vector3(1, -2, 0.5);
  s[0].angular_velocity = Vector3(3, 2, -4);
  s[1].angular_velocity = Vector3(0, 5, 1);
  s.add_ball(0, 1, {0.6, 0, 0.1});
  const auto total = [&] { return momentum({}, s.island.rigid_bodies); };
  const Momentum start = total();
  s.step();  // the joint takes what its bodies did against it
  const Real energy = s.energy();
  for (int k = 0; k < 120; ++k) {
    s.step();
    EXPECT_LT((total().linear - start.linear).norm(), 1e-12) << k;
    EXPECT_LT((total().angular - start.angular).norm(), 1e-12) << k;
    EXPECT_NEAR(s.energy(), energy, 1e-3 * energy) << k;
    EXPECT_LT(s.gap(0), 1e-4) << k;
  }
}

TEST(Joint, AHeavyWeightHangsOnALightChain) {
  JointedIsland s;
  for (int k = 0; k < 20; ++k) s.island.rigid_bodies.push_back(falling_ball(k == 19 ? 1000 : 0.1, {0, -0.5 - k, 0}));
  for (int k = 0; k < 20; ++k) s.add_ball(k, k - 1, {0, -static_cast<Real>(k), 0});
  s.step(60);
  for (std::size_t k = 0; k < 20; ++k) EXPECT_LT(s.gap(k), 1e-4) << k;
}

// However many there are.
TEST(Joint, AThousandKilogramsHangOnThirtyLinksOfOne) {
  JointedIsland s;
  const int links = 30;
  for (int k = 0; k < links; ++k)
    s.island.rigid_bodies.push_back(falling_ball(k + 1 < links ? 1 : 1000, {0.1 * (k + 1), 0, 0}));
  for (int k = 0; k < links; ++k) s.add_ball(k, k - 1, {0.1 * k + 0.05, 0, 0});
  const Real start = s.energy();
  Real gap = 0, lowest = 0;
  for (int k = 0; k < 120; ++k) {
    s.step();
    for (std::size_t joint = 0; joint < links; ++joint) gap = std::max(gap, s.gap(joint));
    lowest = std::min(lowest, s[links - 1].position.y());
  }
  EXPECT_LT(gap, 1e-4);
  EXPECT_LT(lowest, -2.9) << "it swings down";
  EXPECT_LT(s.energy(), start + 1);
}

TEST(Joint, ARingOfFortyLinksInAnyOrderHangsTogether) {
  JointedIsland s;
  const int links = 40;
  const auto angle = [](Real k) { return 2 * std::numbers::pi * k / links; };
  for (int k = 0; k < links; ++k)
    s.island.rigid_bodies.push_back(falling_ball(1, {std::cos(angle(k)), std::sin(angle(k)), 0}));
  for (int n = 0; n < links; ++n) {
    const int k = (7 * n) % links, next = (k + 1) % links;  // far from each other in the island
    s.add_ball(k, next, {std::cos(angle(k + 0.5)), std::sin(angle(k + 0.5)), 0});
  }
  s.add_ball(3, -1, s[3].position);
  Real gap = 0;
  for (int k = 0; k < 120; ++k) {
    s.step();
    for (std::size_t joint = 0; joint <= links; ++joint) gap = std::max(gap, s.gap(joint));
  }
  EXPECT_LT(gap, 1e-4);
}

TEST(Joint, AMotorTurnsAWheelAsItsTorqueSaysUntilItHasItsSpeed) {
  const Real torque = 0.5, speed = 8, mass = 2, radius = 0.3, inertia = 0.4 * mass * radius * radius;
  JointedIsland s;
  s.island.rigid_bodies = {falling_ball(mass, Vector3::Zero())};
  s.add({.a = 0,
         .b = -1,
         .at_a = Vector3::Zero(),
         .at_b = Vector3::Zero(),
         .axis_a = Vector3::UnitZ(),
         .axis_b = Vector3::UnitZ(),
         .speed = speed,
         .torque = torque});
  for (int k = 1; k <= 120; ++k) {
    s.step();
    EXPECT_NEAR(s[0].angular_velocity.z(), std::min(speed, torque / inertia * k * frame), 1e-6) << k;
    EXPECT_LT(s.gap(0), 1e-8) << k;
  }
}

// What a motor does on one body it undoes on the other.
TEST(Joint, AMotorBetweenTwoFreeBodiesKeepsTheAngularMomentum) {
  JointedIsland s;
  s.island.rigid_bodies = {make_sphere(2, 0.3, {0, 0, 0}), make_sphere(1, 0.2, {0.5, 0, 0})};
  s.add({.a = 0,
         .b = 1,
         .at_a = {0.5, 0, 0},
         .at_b = Vector3::Zero(),
         .axis_a = Vector3::UnitZ(),
         .axis_b = Vector3::UnitZ(),
         .speed = 5,
         .torque = 10});
  s.step(60);
  EXPECT_NEAR((s[0].angular_velocity - s[1].angular_velocity).z(), 5, 1e-4);
  const Momentum end = momentum({}, s.island.rigid_bodies);
  EXPECT_LT(end.linear.norm(), 1e-12);
  EXPECT_LT(end.angular.norm(), 1e-12);
}

TEST(Joint, AStopHoldsAgainstAMotorThatPushes) {
  JointedIsland s;
  s.island.rigid_bodies = {make_sphere(2, 0.3, Vector3::Zero())};
  s.add({.a = 0,
         .b = -1,
         .at_a = Vector3::Zero(),
         .at_b = Vector3::Zero(),
         .axis_a = Vector3::UnitZ(),
         .axis_b = Vector3::UnitZ(),
         .speed = 8,
         .torque = 5,
         .most_angle = 1});
  Real furthest = 0;
  for (int k = 0; k < 120; ++k) {
    s.step();
    furthest = std::max(furthest, Eigen::AngleAxis<Real>(s[0].rotation).angle());
  }
  EXPECT_GT(furthest, 0.999);
  EXPECT_LT(furthest, 1.02);
  EXPECT_LT(s[0].angular_velocity.norm(), 0.2);
}

TEST(Joint, ASpringIsStretchedByTheWeightAndSwingsInItsPeriod) {
  const Real mass = 2, stiffness = 500;
  JointedIsland s;
  s.particle.body.options.substeps = 40;
  s.island.rigid_bodies = {falling_ball(mass, Vector3::Zero())};
  s.add({.a = 0, .b = -1, .at_a = Vector3::Zero(), .at_b = Vector3::Zero(), .stiffness = stiffness});
  const Real sag = mass * g / stiffness, rate = std::sqrt(stiffness / mass);
  for (int k = 1; k <= 240; ++k) {
    s.step();
    EXPECT_NEAR(s[0].position.y(), -sag * (1 - std::cos(rate * k * frame)), 1e-2 * sag) << k;
  }
}

TEST(Joint, BreaksWhereARowHasToGiveMoreThanItsStrength) {
  const Real mass = 2, weight = mass * g;
  for (const Real share : {0.9, 1.1}) {
    JointedIsland s;
    s.island.rigid_bodies = {falling_ball(mass, Vector3::Zero())};
    s.add_ball(0, -1, Vector3::Zero()).strength = share * weight * frame;
    s.step();
    EXPECT_EQ(s.island.joints[0].is_broken, share < 1);
    EXPECT_NEAR(s.island.joints[0].given[1], std::min<Real>(share, 1) * weight * frame, 1e-9);
    EXPECT_NEAR(s.island.joints[0].impulse_a.y(), std::min<Real>(share, 1) * weight * frame, 1e-9);
  }
}

// A motor turns what hangs on an axle off its centre; a driver carries both.
TEST(Joint, WhatADriverDoesIsNotTakenForInstability) {
  JointedIsland s;
  RigidBody driver;
  driver.velocity = Vector3(0, 3, 0);
  driver.angular_velocity = Vector3(0, 0, 10);
  s.island.rigid_bodies = {falling_ball(50, {0, -1, 0}), driver};
  s.add_ball(0, 1, {0.5, 0, 0});
  for (int k = 0; k < 60; ++k) {
    const StepReport report = s.step();
    EXPECT_EQ(report.retries, 0) << k;
    EXPECT_LT(s.gap(0), 1e-3) << k;
  }
}

// Three on one axle: more rows than there are ways to move.
TEST(Joint, RowsThatSayTheSameTwiceAreNoTrouble) {
  JointedIsland s;
  s.island.rigid_bodies = {falling_ball(2, {0.5, 0, 0})};
  for (const Real z : {-0.5, 0.0, 0.5}) s.add_ball(0, -1, {0, 0, z});
  const Real start = s.energy();
  for (int k = 0; k < 120; ++k) {
    s.step();
    for (std::size_t joint = 0; joint < 3; ++joint) EXPECT_LT(s.gap(joint), 1e-4) << k;
    EXPECT_NEAR(s.energy(), start, 1e-2) << k;
  }
}

}  // namespace
}  // namespace penalty::testing
