// Rigid bodies that press each other on soft ones, and soft ones that press rigid ones: nothing is swallowed, nothing falls.
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class RigidPile : public WorldTest {
 protected:
  static constexpr Real margin = 0.02;

  void SetUp() override {
    sim.set_gravity({0, -g, 0});
    sim.add_ground();
  }

  btSoftBody& add_soft_box(Real height) {
    return sim.add_jelly(make_box({1, 0.6, 1}, {8, 5, 8}), {.shift = {0, height, 0}, .attach = damped_});
  }
  btSoftBody& add_torus() {
    const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
    return sim.add_jelly(torus, {.shift = {0, 0.022 - torus.vertices.row(1).minCoeff(), 0}, .attach = damped_});
  }

  // How far the deepest node lies within the margin of a box [m].
  Real depth_below(const btSoftBody& body, const btRigidBody& box, const Vector3& half) {
    const Matrix3 rotation = to_matrix(box.getWorldTransform().getBasis());
    const Vector3 origin = to_vector(box.getWorldTransform().getOrigin());
    const PackedVectors& x = sim.penalty().particles(body).positions;
    Real depth = 0;
    for (int i = 0; i < x.cols(); ++i) {
      const Vector3 p = rotation.transpose() * (x.col(i).head<3>() - origin);
      const Real outside = (p - p.cwiseMax(-half).cwiseMin(half)).norm();
      depth = std::max(depth, margin - (outside > 0 ? outside : (p.cwiseAbs() - half).maxCoeff()));
    }
    return depth;
  }

  static btVector3 offset_of(const btRigidBody& box, const btRigidBody& other) {
    return box.getWorldTransform().getOrigin() - other.getWorldTransform().getOrigin();
  }

  // Four seconds; after three nothing lies deep, everything is level, and no step of all gains much.
  void expect_to_stand(const btSoftBody& body, const std::vector<btRigidBody*>& boxes, const Vector3& lowest_half) {
    Real energy = sim.totals().energy;
    std::vector<btVector3> offsets;
    for (std::size_t k = 1; k < boxes.size(); ++k) offsets.push_back(offset_of(*boxes[k], *boxes[k - 1]));
    for (int k = 0; k < 240; ++k) {
      sim.step(frame);
      const Real now = sim.totals().energy;
      EXPECT_LT(now - energy, 1e-3 * energy) << "frame " << k;
      energy = now;
      if (k >= 180) {
        EXPECT_LT(depth_below(body, *boxes[0], lowest_half), 0.003) << "frame " << k;
      }
    }
    for (const btRigidBody* box : boxes) {
      EXPECT_GT(Real(box->getWorldTransform().getBasis()[1][1]), 0.998) << "tilted";
      EXPECT_LT(Real(box->getAngularVelocity().length()), 0.3);
    }
    for (std::size_t k = 1; k < boxes.size(); ++k) {
      const btVector3 offset = offset_of(*boxes[k], *boxes[k - 1]) - offsets[k - 1];
      EXPECT_LT(std::hypot(Real(offset.x()), Real(offset.z())), 0.03) << "slid off";
    }
    EXPECT_GT(lowest(body), 0.019);
  }

  AttachOptions damped_{.step = {.damping_time = 0.02}};
};

TEST_P(RigidPile, TenKilogramsOnHalfAKilogramOnASoftBox) {
  const btSoftBody& body = add_soft_box(0.021);
  const Vector3 half(0.15, 0.1, 0.15);
  btRigidBody& lower = sim.add_box(half, 0.5, {0.5, 0.751, 0.5});
  expect_to_stand(body, {&lower, &sim.add_box(half, 10, {0.5, 0.971, 0.5})}, half);
}

TEST_P(RigidPile, TenKilogramsOnHalfAKilogramStayWhereTheyAre) {
  add_soft_box(0.021);
  btRigidBody& lower = sim.add_box({0.15, 0.1, 0.15}, 0.5, {0.5, 0.751, 0.5});
  btRigidBody& upper = sim.add_box({0.15, 0.1, 0.15}, 10, {0.5, 0.971, 0.5});
  const auto offset = [](const btRigidBody& body) {
    const btVector3& x = body.getWorldTransform().getOrigin();
    return std::hypot(Real(x.x()) - 0.5, Real(x.z()) - 0.5);
  };
  sim.step(frame, 600);
  EXPECT_LT(offset(lower), 0.005);
  EXPECT_LT(offset(upper), 0.005);
  EXPECT_LT(Real(upper.getAngularVelocity().length()), 0.02) << "and does not rock";
}

TEST_P(RigidPile, TwoTimesTenKilogramsOnATorusOfOne) {
  const btSoftBody& body = add_torus();
  btRigidBody& lower = sim.add_box({1.2, 0.15, 1.2}, 10, {0, 0.8, 0});
  expect_to_stand(body, {&lower, &sim.add_box({0.6, 0.15, 0.6}, 10, {0, 1.12, 0})}, {1.2, 0.15, 1.2});
}

// Smaller than the torus, and beside its axis.
TEST_P(RigidPile, ATowerThatStandsAsideOnATorusStaysThere) {
  const btSoftBody& body = add_torus();
  const Vector3 half(0.6, 0.15, 0.6);
  btRigidBody& lower = sim.add_box(half, 10, {0.05, 0.8, 0});
  expect_to_stand(body, {&lower, &sim.add_box({0.3, 0.15, 0.3}, 10, {0.1, 1.105, 0})}, half);
  EXPECT_NEAR(Real(lower.getWorldTransform().getOrigin().x()), 0.05, 0.08);
}

TEST_P(RigidPile, FiveBoxesOnATorus) {
  const btSoftBody& body = add_torus();
  std::vector<btRigidBody*> boxes;
  boxes.reserve(5);
  for (int k = 0; k < 5; ++k) boxes.push_back(&sim.add_box({1.2, 0.1, 1.2}, 2, {0, 0.742 + 0.21 * k, 0}));
  expect_to_stand(body, boxes, {1.2, 0.1, 1.2});
}

TEST_P(RigidPile, ALightBallIsNotSwallowedByAHeavySoftBoxOnIt) {
  for (const Real mass : {0.1, 1.0}) {
    SCOPED_TRACE(mass);
    Simulation own(GetParam());
    own.set_gravity({0, -g, 0});
    own.add_ground();
    const TetMesh box = make_box({1, 0.6, 1}, {8, 5, 8});
    const btSoftBody& body =
        own.add_jelly(box, {.shift = {0, 0.221, 0}, .body = {.mass = 10, .friction = 1}, .attach = damped_});
    btRigidBody& ball = own.add_rigid(std::make_unique<btSphereShape>(btScalar(0.1)), mass, {0.5, 0.1, 0.5});
    Real energy = own.totals().energy;
    for (int k = 0; k < 240; ++k) {
      own.step(frame);
      const Vector3 center = to_vector(ball.getWorldTransform().getOrigin());
      EXPECT_GT(center.y(), 0.098) << "pressed into the ground, frame " << k;
      const PackedVectors& x = own.penalty().particles(body).positions;
      const Real nearest = (x.topRows<3>().colwise() - center).colwise().norm().minCoeff();
      EXPECT_GT(nearest, 0.1 + margin - 0.003) << "frame " << k;
      const Real now = own.totals().energy;
      EXPECT_LT(now - energy, 1e-3 * energy) << "frame " << k;
      energy = now;
    }
  }
}

// Held soft ground, a plate on it, a cube on that: of the cube's contact everything is decided between rigid bodies.
class OnAPlate : public RigidPile {
 protected:
  btRigidBody& add_plate(Real mass) {
    const TetMesh mesh = make_box({1, 0.2, 1}, {4, 1, 4});
    btSoftBody& body = sim.add_jelly(mesh, {.stiffness = 50, .shift = {0, 0.021, 0}, .attach = damped_});
    body.m_cfg.kDF = 1;
    btRigidBody& plate = sim.add_box({0.5, 0.05, 0.5}, mass, {0.5, 0.292, 0.5});
    plate.setFriction(1);
    return plate;
  }
};

TEST_P(OnAPlate, ACubeThatSlidesIsBrakedByCoulombsFrictionOnce) {
  btRigidBody& plate = add_plate(50);
  btRigidBody& cube = sim.add_box({0.05, 0.05, 0.05}, 0.5, {0.2, 0.3921, 0.5});
  cube.setFriction(btScalar(0.3));
  sim.step(frame, 60);
  cube.setLinearVelocity(btVector3(2, 0, 0));
  sim.step(frame, 12);
  const Real braked = 2 - Real(cube.getLinearVelocity().x() - plate.getLinearVelocity().x());
  EXPECT_NEAR(braked, 0.3 * g * 0.2, 0.1 * 0.3 * g * 0.2);
}

TEST_P(OnAPlate, ABallBouncesWithItsRestitution) {
  btRigidBody& plate = add_plate(50);
  plate.setRestitution(1);
  sim.step(frame, 60);
  btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.05)), 0.1, {0.5, 0.85, 0.5});
  ball.setRestitution(btScalar(0.8));
  Real before = 0, after = 0;
  for (int k = 0; k < 30 && !(after > 0); ++k) {
    before = after;
    sim.step(frame);
    after = Real(ball.getLinearVelocity().y());
  }
  // The plate trembles; in the step of the impact there was gravity.
  const Real of_plate = Real(plate.getLinearVelocity().y());
  EXPECT_NEAR((after - of_plate) / (of_plate - before + g * frame), 0.8, 0.03);
}

// Of one body, since Bullet steps several in an order that depends on whatever else is in the world.
TEST_P(RigidPile, WhatTouchesNoSoftBodyMovesAsInStockBullet) {
  const auto run = [&](Solver solver) {
    Simulation own(GetParam(), solver);
    own.set_gravity({0, -g, 0});
    own.add_ground();
    const TetMesh mesh = moved(make_box({1, 0.6, 1}, {3, 2, 3}), {20, 0.021, 0});
    btSoftBody& body = own.add(make_soft_body(own.info(), mesh, SoftBodyOptions{}));
    if (solver == Solver::penalty) own.penalty().attach(body, make_elastic_field(mesh.vertices, mesh.tetrahedra, 10.0));
    btRigidBody& box = own.add_box({0.2, 0.1, 0.3}, 2, {0, 0.8, 0});
    box.setAngularVelocity(btVector3(3, 2, -4));
    box.setLinearVelocity(btVector3(1, 0, 2));
    own.step(frame, 90);
    return box.getWorldTransform();
  };
  EXPECT_TRUE(run(Solver::penalty) == run(Solver::bullet));
}

INSTANTIATE_TEST_SUITE_P(World, RigidPile, both_worlds(), param_name);
INSTANTIATE_TEST_SUITE_P(World, OnAPlate, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
