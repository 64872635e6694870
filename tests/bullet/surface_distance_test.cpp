// The nearest surface point of each collision shape, against closed forms.
#include "bullet/simulation.h"

#include "surface_distance.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <functional>

namespace penalty::testing {
namespace {

using Distance = std::function<Real(const Vector3&)>;  // signed, negative inside

// Of the convex solid that the polyline, from axis to axis, sweeps about the y axis; outward is to its right.
Real revolved_distance(const Vector3& p, const std::vector<Eigen::Vector2d>& profile) {
  const Eigen::Vector2d q(std::hypot(p.x(), p.z()), p.y());
  Real nearest = 1e9, outside = -1e9;
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    const Eigen::Vector2d& a = profile[k];
    const Eigen::Vector2d edge = profile[k + 1] - a;
    const Real t = std::clamp((q - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (q - a - t * edge).norm());
    outside = std::max(outside, Eigen::Vector2d(edge.y(), -edge.x()).dot(q - a));
  }
  return outside > 0 ? nearest : -nearest;
}

std::vector<SurfacePoint> surface_points(const btCollisionShape& shape, const Vector3& point, Real reach = 100) {
  std::vector<SurfacePoint> found;
  append_surface_points(shape, point, reach, found);
  return found;
}

// What is found lies on the surface, as far away as the distance says, along the normal.
void expect_distance(const btCollisionShape& shape, const Distance& distance, Real tolerance, Real inside_tolerance,
                     Real size = 1.5) {
  Random random(11);
  int inside = 0;
  Real worst = 0, worst_inside = 0;
  for (int k = 0; k < 500; ++k) {
    const Vector3 p = random.vector(size);
    SCOPED_TRACE(::testing::Message() << "sample " << k << " at " << p.transpose());
    const Real expected = distance(p);
    const std::vector<SurfacePoint> found = surface_points(shape, p);
    ASSERT_EQ(found.size(), 1u);
    const Real limit = expected < 0 ? inside_tolerance : tolerance;
    inside += expected < 0;
    (expected < 0 ? worst_inside : worst) =
        std::max(expected < 0 ? worst_inside : worst, std::abs(found[0].distance - expected));
    ASSERT_NEAR(found[0].distance, expected, limit);
    ASSERT_NEAR(distance(found[0].point), 0, limit);
    ASSERT_NEAR(found[0].normal.norm(), 1, 1e-3);
    ASSERT_LT((p - found[0].distance * found[0].normal - found[0].point).norm(), 1e-5);
  }
  EXPECT_GT(inside, 10);
  EXPECT_LT(inside, 490);
  ::testing::Test::RecordProperty("worst", std::to_string(worst * 1e9) + "e-9");
  ::testing::Test::RecordProperty("worst_inside", std::to_string(worst_inside * 1e9) + "e-9");
}

TEST(SurfaceDistance, OfASphere) {
  const btSphereShape sphere(0.75);
  expect_distance(sphere, [](const Vector3& p) { return p.norm() - 0.75; }, 1e-12, 1e-12);
  const std::vector<SurfacePoint> center = surface_points(sphere, {0, 0, 0});
  ASSERT_EQ(center.size(), 1u);
  EXPECT_NEAR(center[0].distance, -0.75, 1e-12);
  EXPECT_NEAR(center[0].normal.norm(), 1, 1e-12) << "any direction, but one";
}

TEST(SurfaceDistance, OfABox) {
  const Vector3 half(0.5, 0.25, 1);
  const btBoxShape box(to_bullet(half));
  expect_distance(box, [&](const Vector3& p) { return box_distance(p, half); }, limit(1e-12, 1e-7), limit(1e-12, 1e-7));
}

TEST(SurfaceDistance, OfCapsulesAlongEachAxis) {
  const auto law = [](int axis) {
    return [axis](const Vector3& p) {
      Vector3 core = Vector3::Zero();
      core[axis] = std::clamp(p[axis], -0.5, 0.5);
      return (p - core).norm() - 0.25;
    };
  };
  expect_distance(btCapsuleShapeX(0.25, 1), law(0), 1e-7, 1e-7, 1);
  expect_distance(btCapsuleShape(0.25, 1), law(1), 1e-7, 1e-7, 1);
  expect_distance(btCapsuleShapeZ(0.25, 1), law(2), 1e-7, 1e-7, 1);
}

TEST(SurfaceDistance, OfAPlane) {
  const Vector3 normal = Vector3(1, 2, 2) / 3;
  const btStaticPlaneShape plane(to_bullet(normal), static_cast<btScalar>(0.25));
  expect_distance(
      plane, [&](const Vector3& p) { return normal.dot(p) - 0.25; }, limit(1e-12, 1e-6), limit(1e-12, 1e-6));
}

// Bullet rounds these by their collision margin: a core, swept by a small sphere. Inside, EPA approximates curved
// surfaces by a polytope.
TEST(SurfaceDistance, OfACylinder) {
  const btCylinderShape cylinder(btVector3(0.5, 0.75, 0.5));
  const Real m = Real(cylinder.getMargin()), r = 0.5 - m, h = 0.75 - m;
  expect_distance(
      cylinder, [&](const Vector3& p) { return revolved_distance(p, {{0, -h}, {r, -h}, {r, h}, {0, h}}) - m; },
      limit(1e-4, 5e-4), 5e-3);
}

TEST(SurfaceDistance, OfACone) {
  const btConeShape cone(static_cast<btScalar>(0.6), static_cast<btScalar>(1.2));
  const Real m = Real(cone.getMargin());
  expect_distance(
      cone, [&](const Vector3& p) { return revolved_distance(p, {{0, -0.6}, {0.6, -0.6}, {0, 0.6}}) - m; },
      limit(1e-4, 5e-4), 5e-3, 0.8);
}

TEST(SurfaceDistance, OfAConvexHull) {
  const Vector3 half(0.5, 0.4, 0.7);
  btConvexHullShape hull;
  for (int corner = 0; corner < 8; ++corner)
    hull.addPoint(to_bullet(Vector3(corner & 1 ? half.x() : -half.x(), corner & 2 ? half.y() : -half.y(),
                                    corner & 4 ? half.z() : -half.z())));
  const Real m = Real(hull.getMargin());
  expect_distance(
      hull, [&](const Vector3& p) { return box_distance(p, half) - m; }, limit(1e-6, 1e-3), limit(1e-6, 2e-3));
}

TEST(SurfaceDistance, OfACompoundIsOnePointForEachChild) {
  btSphereShape sphere(0.25);
  btBoxShape box(btVector3(0.5, 0.25, 0.125));
  btCompoundShape compound;
  Random random(3);
  const Matrix3 rotation = random.rotation();
  const Vector3 ball_at(1, 0, 0), box_at(-0.5, 0.25, 0);
  btTransform ball_transform, box_transform;
  ball_transform.setIdentity();
  ball_transform.setOrigin(to_bullet(ball_at));
  box_transform.setOrigin(to_bullet(box_at));
  box_transform.setBasis(btMatrix3x3(btScalar(rotation(0, 0)), btScalar(rotation(0, 1)), btScalar(rotation(0, 2)),
                                     btScalar(rotation(1, 0)), btScalar(rotation(1, 1)), btScalar(rotation(1, 2)),
                                     btScalar(rotation(2, 0)), btScalar(rotation(2, 1)), btScalar(rotation(2, 2))));
  compound.addChildShape(ball_transform, &sphere);
  compound.addChildShape(box_transform, &box);
  for (int k = 0; k < 200; ++k) {
    const Vector3 p = random.vector(1.5);
    const std::vector<SurfacePoint> found = surface_points(compound, p);
    ASSERT_EQ(found.size(), 2u);
    ASSERT_NEAR(found[0].distance, (p - ball_at).norm() - 0.25, 1e-6);
    ASSERT_NEAR(found[1].distance, box_distance(rotation.transpose() * (p - box_at), {0.5, 0.25, 0.125}), 1e-6);
    for (const SurfacePoint& s : found) ASSERT_LT((p - s.distance * s.normal - s.point).norm(), 1e-6);
  }
}

TEST(SurfaceDistance, BeyondItsReachNothingIsFound) {
  const btSphereShape sphere(0.75);
  EXPECT_EQ(surface_points(sphere, {1.75, 0, 0}, 0.99).size(), 0u);
  EXPECT_EQ(surface_points(sphere, {1.75, 0, 0}, 1.01).size(), 1u);
  const btConeShape cone(1, 1);
  EXPECT_EQ(surface_points(cone, {0, 5, 0}, 1).size(), 0u);
}

}  // namespace
}  // namespace penalty::testing
