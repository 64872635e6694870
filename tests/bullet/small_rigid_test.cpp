// Rigid bodies that are small or sharp against the triangles of a soft one: what touches lies between the nodes. Depths are
// measured from samples of the rigid surface in the tetrahedra.
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>

#include <Eigen/LU>
#include <functional>
#include <limits>
#include <numbers>

#include "bullet/simulation.h"
#include "contact/crossings.h"
#include "penalty/contact/closest_points.h"
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/length.h"
#include "penalty/mesh/embed.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

// How deep a point lies in a mesh of tetrahedra: its distance from the boundary, zero outside [m].
class Depth {
 public:
  Depth(const TetMesh& mesh, const PackedVectors& positions)
      : tetrahedra_(mesh.tetrahedra), boundary_(boundary_faces(mesh.tetrahedra)), positions_(positions) {}

  Real of(const Vector3& point) const {
    const auto is_in = [&](const auto& t) {
      Matrix3 edges;
      for (int k = 0; k < 3; ++k) edges.col(k) = at(t[k + 1]) - at(t[0]);
      const Vector3 weights = edges.inverse() * (point - at(t[0]));
      return weights.minCoeff() >= 0 && weights.sum() <= 1;
    };
    if (std::none_of(tetrahedra_.begin(), tetrahedra_.end(), is_in)) return 0;
    Real distance = std::numeric_limits<Real>::infinity();
    for (const auto& [i, j, k] : boundary_)
      distance = std::min(distance, closest_points_of_triangle(point, at(i), at(j), at(k)).difference.norm());
    return distance;
  }
  Real of(const std::vector<Vector3>& points, const btRigidBody& rigid) const {  // points in the frame of the body
    const Matrix3 rotation = to_matrix(rigid.getWorldTransform().getBasis());
    const Vector3 origin = to_vector(rigid.getWorldTransform().getOrigin());
    Real deepest = 0;
    for (const Vector3& point : points) deepest = std::max(deepest, of(rotation * point + origin));
    return deepest;
  }

 private:
  Vector3 at(int i) const { return positions_.col(i).head<3>(); }

  std::vector<Tetrahedron> tetrahedra_;
  std::vector<Triangle> boundary_;
  const PackedVectors& positions_;
};

std::unique_ptr<btCollisionShape> box_of(Real half) {
  return std::make_unique<btBoxShape>(to_bullet(Vector3(half, half, half)));
}

std::vector<Vector3> samples_of_box(const Vector3& half) {
  std::vector<Vector3> samples;
  constexpr int n = 6;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (int k = 0; k <= n; ++k)
        if (i % n == 0 || j % n == 0 || k % n == 0)
          samples.push_back(half.cwiseProduct(Vector3(2.0 * i / n - 1, 2.0 * j / n - 1, 2.0 * k / n - 1)));
  return samples;
}

std::vector<Vector3> samples_of_capsule(Real radius, Real half_height) {
  std::vector<Vector3> samples;
  for (int i = -5; i <= 5; ++i)
    for (int k = 0; k < 12; ++k) {
      const Real angle = k * std::numbers::pi / 6;
      samples.push_back({half_height * i / 5, radius * std::cos(angle), radius * std::sin(angle)});
    }
  return samples;
}

class SmallRigid : public WorldTest {
 protected:
  // Of each mass, laid down 3 cm above the middle of a triangle of a box of 20 cm cells, in a world of its own.
  void expect_held(const std::function<std::unique_ptr<btCollisionShape>()>& shape, Real height,
                   const Matrix3& rotation, const std::vector<Vector3>& samples, bool may_turn) {
    for (const Real mass : {0.01, 0.3, 10.0}) {
      SCOPED_TRACE(mass);
      Simulation own(GetParam());
      own.set_gravity({0, -9.81, 0});
      own.add_ground();
      const TetMesh coarse = make_box({1, 0.6, 1}, {5, 3, 5});
      const btSoftBody& body =
          own.add_jelly(coarse, {.shift = {0, 0.021, 0}, .attach = {.step = {.damping_time = 0.002}}});
      btRigidBody& rigid = own.add_rigid(shape(), mass, {0.47, 0.651 + height, 0.53}, rotation);
      if (!may_turn) rigid.setAngularFactor(0);
      const Depth depth(coarse, own.penalty().particles(body).positions);
      Real deepest = 0;
      for (int k = 0; k < 150; ++k) {
        own.step(frame);
        if (k % 5 == 0) deepest = std::max(deepest, depth.of(samples, rigid));
      }
      EXPECT_LT(deepest, 0.005);
      EXPECT_GT(Real(rigid.getWorldTransform().getOrigin().y()), 0.4 + height) << "fell off or in";
    }
  }
};

TEST_P(SmallRigid, ABallLiesOnATriangle) {
  expect_held([] { return std::make_unique<btSphereShape>(btScalar(0.025)); }, 0.025, Matrix3::Identity(),
              samples_of_capsule(0.025, 0), true);
}

TEST_P(SmallRigid, ARodLiesAcrossTriangles) {
  expect_held([] { return std::make_unique<btCapsuleShapeX>(btScalar(0.02), btScalar(0.6)); }, 0.02,
              Matrix3::Identity(), samples_of_capsule(0.02, 0.3), true);
}

TEST_P(SmallRigid, ACylinderLiesAcrossTriangles) {
  expect_held(
      [] { return std::make_unique<btCylinderShapeX>(btVector3(btScalar(0.3), btScalar(0.02), btScalar(0.02))); }, 0.02,
      Matrix3::Identity(), samples_of_capsule(0.02, 0.3), true);
}

TEST_P(SmallRigid, ACornerStandsOnATriangle) {
  expect_held([] { return box_of(0.1); }, 0.1 * std::sqrt(3),
              (turned(std::atan(std::sqrt(0.5)), Vector3::UnitX()) * turned(std::numbers::pi / 4, Vector3::UnitZ())),
              samples_of_box({0.1, 0.1, 0.1}), false);
}

TEST_P(SmallRigid, AnEdgeStandsOnTriangles) {
  expect_held([] { return box_of(0.1); }, 0.1 * std::sqrt(2), turned(std::numbers::pi / 4, Vector3::UnitZ()),
              samples_of_box({0.1, 0.1, 0.1}), false);
}

// A tetrahedron of points and a box inside a compound, which reach beyond their points by Bullet's margin.
TEST_P(SmallRigid, ACornerOfAHullInACompoundStandsOnATriangle) {
  btConvexHullShape hull;
  for (const btVector3& point : {btVector3(0, -1, 0), btVector3(1, 1, 0), btVector3(-1, 1, 1), btVector3(-1, 1, -1)})
    hull.addPoint(btScalar(0.1) * point);
  const auto make = [&] {
    auto compound = std::make_unique<btCompoundShape>();
    btTransform up = btTransform::getIdentity();
    up.setOrigin(btVector3(0, btScalar(0.3), 0));
    compound->addChildShape(up, &hull);
    return compound;
  };
  std::vector<Vector3> samples;
  samples.reserve(hull.getNumPoints());
  for (int k = 0; k < hull.getNumPoints(); ++k)
    samples.push_back(to_vector(hull.getScaledPoint(k)) + Vector3(0, 0.3, 0));
  expect_held(make, -0.2 + 0.04, Matrix3::Identity(), samples, false);
}

// Each of its particles, and each of its triangles, would push a ball that starts inside a body its own way: it stays, and
// gives no energy.
TEST_P(SmallRigid, WhatStartsInACornerOfABodyStays) {
  for (const Real stiffness : {10.0, 1000.0}) {
    Simulation of(GetParam());
    of.set_gravity({0, -9.81, 0});
    of.add_ground();
    const btSoftBody& body =
        of.add_jelly(make_box({0.25, 0.25, 0.25}, {3, 3, 4}), {.stiffness = stiffness,
                                                               .shift = {0, 0.3, 0},
                                                               .body = {.mass = 0.5},
                                                               .attach = {.step = {.damping_time = 0.002}}});
    const btRigidBody& ball = of.add_rigid(std::make_unique<btSphereShape>(btScalar(0.08)), 0.5, {0.2, 0.5, 0.2});
    SCOPED_TRACE(stiffness);
    int substeps = 0;
    Real gain = 0, energy = of.totals().energy;
    const Real start = energy;
    for (int k = 0; k < 180; ++k) {
      of.step(frame);
      substeps = std::max(substeps, of.penalty().report(body).substeps);
      const Real now = of.totals().energy;
      gain = std::max(gain, now - energy);
      energy = now;
    }
    EXPECT_LT(gain, 1e-4 * start);
    EXPECT_LT(substeps, stiffness == 10 ? 50 : 500);
    EXPECT_LT(ball.getLinearVelocity().length(), 0.1);
  }
}

// Deep within the margins, or within the body, at the start: it comes out slowly, or stays, at the cost of one that is laid
// down, and gives no energy to speak of.
TEST_P(SmallRigid, WhatStartsInTheMarginsOrInTheBodyDoesNotBlowUp) {
  const auto run = [](Real depth, bool is_ball) {
    Simulation of(GetParam());
    of.set_gravity({0, -9.81, 0});
    of.add_ground();
    const btSoftBody& body = of.add_jelly(make_box({1, 0.5, 1}, {8, 4, 8}),
                                          {.shift = {-0.5, 0.021, -0.5}, .attach = {.step = {.damping_time = 0.002}}});
    btRigidBody& thing = of.add_rigid(
        is_ball ? std::unique_ptr<btCollisionShape>(std::make_unique<btSphereShape>(btScalar(0.1))) : box_of(0.1), 1,
        {0.03, 0.621 - depth, 0.02});
    struct {
      int most_substeps = 0;
      Real fastest = 0, end = 0;
    } result;
    for (int k = 0; k < 120; ++k) {
      of.step(frame);
      result.most_substeps = std::max(result.most_substeps, of.penalty().report(body).substeps);
      result.fastest = std::max(result.fastest, Real(thing.getLinearVelocity().length()));
    }
    result.end = Real(thing.getWorldTransform().getOrigin().y());
    return result;
  };
  for (const bool is_ball : {true, false}) {
    const auto laid_down = run(-0.03, is_ball);
    for (const Real depth : {0.0, 0.005, 0.01, 0.1, 0.15}) {
      const auto result = run(depth, is_ball);
      SCOPED_TRACE((is_ball ? "ball " : "box ") + std::to_string(depth));
      EXPECT_LE(result.most_substeps, 2 * laid_down.most_substeps);
      EXPECT_LT(result.fastest, 1);
      if (depth <= 0.01)
        EXPECT_NEAR(result.end, laid_down.end, 0.03);
      else
        EXPECT_GT(result.end, 0.42);
    }
  }
}

// A hull of one point is a ball of Bullet's margin, and so is a ball that is scaled.
TEST_P(SmallRigid, AHullOfOnePointLiesOnATriangle) {
  const auto make = [] {
    auto hull = std::make_unique<btConvexHullShape>();
    hull->addPoint(btVector3(0, 0, 0));
    return hull;
  };
  expect_held(make, 0.04, Matrix3::Identity(), samples_of_capsule(0.04, 0), false);
}

TEST_P(SmallRigid, AHullOfNoPointsTouchesNothing) {
  const btSoftBody& body = sim.add_jelly(make_box({1, 0.6, 1}, {2, 2, 2}));
  sim.add_rigid(std::make_unique<btConvexHullShape>(), 1, {0.5, 0.6, 0.5});
  sim.step(frame, 3);
  EXPECT_EQ(sim.penalty().report(body).problem, "");
}

TEST_P(SmallRigid, AFastBallDoesNotPassATorus) {
  const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
  for (const Real speed : {5.0, 20.0, 50.0}) {
    SCOPED_TRACE(speed);
    btSoftBody& body = sim.add_jelly(torus);
    btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.025)), 0.1, {1.4, 0.03, 0.02});
    ball.setLinearVelocity(btVector3(btScalar(-speed), 0, 0));
    ball.setFriction(btScalar(0.01));  // Bullet takes spin beyond a quarter turn a step from rigid bodies
    const Totals start = sim.totals();
    Real deepest = 0, highest = start.energy;
    const Depth depth(torus, sim.penalty().particles(body).positions);
    for (int k = 0; k < static_cast<int>(1.2 / speed / frame) + 20; ++k) {
      sim.step(frame);
      deepest = std::max(deepest, depth.of(samples_of_capsule(0.025, 0), ball));
      highest = std::max(highest, sim.totals().energy);
    }
    const Totals end = sim.totals();
    EXPECT_LT(deepest, 0.005);
    EXPECT_GT(Real(ball.getLinearVelocity().x()), 0) << "does not bounce";
    EXPECT_LE(highest, start.energy * limit(1 + 1e-12, 1 + 1e-6));
    const Real momentum = 0.1 * speed;
    EXPECT_LT((end.momentum - start.momentum).norm(), limit(1e-12, 1e-5) * momentum);
    EXPECT_LT((end.angular_momentum - start.angular_momentum).norm(), limit(1e-12, 1e-5) * momentum);
    sim.remove(ball);
    sim.remove(body);
  }
}

TEST_P(SmallRigid, AFastBallDoesNotPassAThinSheet) {
  const TriangleSurface sheet = make_sheet(1, 1, 10, 10);
  std::vector<int> rim;
  for (int i = 0; i < sheet.vertices.cols(); ++i)
    if ((sheet.vertices.col(i).head<2>().array() < 1e-6).any() ||
        (sheet.vertices.col(i).head<2>().array() > 1 - 1e-6).any())
      rim.push_back(i);
  for (const Real speed : {5.0, 20.0, 50.0}) {
    SCOPED_TRACE(speed);
    btSoftBody& body = sim.add(make_soft_body(sim.info(), sheet, {.mass = 0.5, .pinned = rim, .margin = 0.001}));
    PotentialField field(sheet.vertices);
    field.add<Length>(edges_of(std::span<const Triangle>(sheet.triangles)), 10);
    field.add<BendingAngle>(hinges_of(sheet.triangles), 1e-4);
    sim.penalty().attach(body, std::move(field));
    btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.025)), 0.1, {0.52, 0.47, 0.3});
    ball.setLinearVelocity(btVector3(0, 0, btScalar(-speed)));
    const Real start = sim.totals().energy;
    Real highest = start;
    for (int k = 0; k < static_cast<int>(0.3 / speed / frame) + 40; ++k) {
      sim.step(frame);
      highest = std::max(highest, sim.totals().energy);
    }
    EXPECT_GT(Real(ball.getLinearVelocity().z()), 0) << "passed";
    EXPECT_GT(Real(ball.getWorldTransform().getOrigin().z()), 0);
    EXPECT_LE(highest, start * limit(1 + 1e-12, 1 + 1e-6));
    sim.remove(ball);
    sim.remove(body);
  }
}

TEST_P(SmallRigid, ABallLiesOnAnEmbeddedCubeOfTwelveTriangles) {
  TriangleSurface cube;
  cube.vertices.resize(3, 8);
  for (int k = 0; k < 8; ++k) cube.vertices.col(k) = Vector3(k & 1, (k >> 1) & 1, (k >> 2) & 1);
  cube.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const EmbeddedSurface embedded = embed(cube, {.cells = 5});
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  std::vector<WeightedPoint> corners = BodySurface::of(embedded).points;
  btSoftBody& body =
      sim.add(make_soft_body(sim.info(), moved(embedded.lattice, {0, 0.03, 0}), {.mass = 20, .margin = 0.02}));
  sim.penalty().attach(
      body, make_elastic_field(embedded.lattice.vertices, embedded.lattice.tetrahedra, 200.0),
      {.step = {.damping_time = 0.02}, .contact_points = corners, .surface = BodySurface::of(embedded)});
  btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.3)), 2, {0.4, 1.4, 0.45});
  ball.setDamping(0, 0.5);
  for (int k = 0; k < 120; ++k) {
    sim.step(frame);
    const Eigen::Matrix3Xd skin_now =
        skin(embedded, Eigen::Matrix3Xd(sim.penalty().particles(body).positions.topRows<3>()));
    const Vector3 center = to_vector(ball.getWorldTransform().getOrigin());
    Real distance = 1;
    for (const auto& [i, j, l] : cube.triangles)
      distance = std::min(
          distance,
          closest_points_of_triangle(center, skin_now.col(i), skin_now.col(j), skin_now.col(l)).difference.norm());
    EXPECT_GT(distance, 0.295);
    EXPECT_GT(center.y(), 1.2);
  }
}

INSTANTIATE_TEST_SUITE_P(World, SmallRigid, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
