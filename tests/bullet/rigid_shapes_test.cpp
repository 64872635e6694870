// A soft ball falls on each kind of rigid shape and stays on top of it.
#include "bullet/simulation.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include "surface_distance.h"

namespace penalty::testing {
namespace {

using std::numbers::pi;

class Landing : public WorldTest {
 protected:
  static constexpr Real margin = 0.02;

  // `top`: height of the shape above its origin where the ball comes down.
  void land(std::unique_ptr<btCollisionShape> shape, const Matrix3& rotation, Real top) {
    sim.set_gravity({0, -9.81, 0});
    const Vector3 at(3, 1, -2);  // away from the origin, so that no transform can be forgotten
    btRigidBody& rigid = sim.add_rigid(std::move(shape), 0, at, rotation);
    rigid.setFriction(1);
    const Real radius = 0.25;
    btSoftBody& ball = sim.add_jelly(make_ball(radius, 2), {.shift = at + Vector3(0, top + radius + 0.2, 0),
                                                            .attach = {.step = {.damping_time = 0.02}}});
    Real depth = -1;
    for (int k = 0; k < 150; ++k) {
      sim.step(1.0 / 60);
      ASSERT_TRUE(sim.penalty().report(ball).finite) << "step " << k;
      depth = std::max(depth, deepest(ball, rigid));
    }
    RecordProperty("depth_below_margin_um", std::to_string((depth + margin) * 1e6));
    EXPECT_LT(depth, 0) << "went through the surface";
    EXPECT_GT(depth, -1.05 * margin) << "never touched it";
    const Vector3 center = center_of_mass(sim.penalty().particles(ball)) - at;
    EXPECT_NEAR(center.y(), top + margin + radius, 0.15 * radius);
    EXPECT_LT(std::hypot(center.x(), center.z()), 0.35) << "rolled off";
  }

  // Of the deepest node, measured from the shape itself [m].
  static Real deepest(const btSoftBody& ball, const btRigidBody& rigid) {
    Real depth = -1e9;
    std::vector<SurfacePoint> found;
    for (int i = 0; i < ball.m_nodes.size(); ++i) {
      found.clear();
      const btVector3 local = rigid.getWorldTransform().invXform(ball.m_nodes[i].m_x);
      append_surface_points(*rigid.getCollisionShape(), to_vector(local), 10, found);
      for (const SurfacePoint& point : found) depth = std::max(depth, -point.distance);
    }
    return depth;
  }
};

// A ball on a ball, or on a ridge, rolls off: these are almost flat.
TEST_P(Landing, Sphere) { land(std::make_unique<btSphereShape>(30), Matrix3::Identity(), 30); }

TEST_P(Landing, Box) { land(std::make_unique<btBoxShape>(btVector3(1, 0.5, 1)), turned(0.4, Vector3::UnitY()), 0.5); }

TEST_P(Landing, BoxOnItsSide) {
  land(std::make_unique<btBoxShape>(btVector3(0.5, 1, 1)), turned(pi / 2, Vector3::UnitZ()), 0.5);
}

TEST_P(Landing, Capsule) {
  land(std::make_unique<btCapsuleShape>(btScalar(30), btScalar(2)), turned(pi / 2, Vector3::UnitX()), 30);
}

TEST_P(Landing, CylinderUpright) {
  land(std::make_unique<btCylinderShape>(btVector3(1, 0.5, 1)), turned(0.3, Vector3::UnitY()), 0.5);
}

TEST_P(Landing, CylinderUpsideDown) {
  land(std::make_unique<btCylinderShapeZ>(btVector3(1, 1, 0.5)), turned(pi / 2, Vector3::UnitX()), 0.5);
}

TEST_P(Landing, ConeOnItsTip) {
  auto cone = std::make_unique<btConeShape>(btScalar(1), btScalar(1));
  const Real top = 0.5 + Real(cone->getMargin());
  land(std::move(cone), turned(pi, Vector3::UnitX()), top);
}

TEST_P(Landing, ConvexHull) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Real y : {-0.5, 0.5})
    for (int k = 0; k < 7; ++k) {
      const Real radius = y > 0 ? 0.8 : 1.2;
      hull->addPoint(to_bullet(Vector3(radius * std::cos(2 * pi * k / 7), y, radius * std::sin(2 * pi * k / 7))));
    }
  const Real top = 0.5 + Real(hull->getMargin());
  land(std::move(hull), turned(1, Vector3::UnitY()), top);
}

TEST_P(Landing, StaticPlane) {
  land(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0.25)), turned(-pi / 2, Vector3::UnitX()),
       0.25);
}

TEST_P(Landing, Compound) {
  // Two beams side by side: the ball rests on both.
  static btBoxShape beam(btVector3(0.5, 0.25, 0.125));
  auto compound = std::make_unique<btCompoundShape>();
  for (const Real z : {-0.13, 0.13}) {
    btTransform transform;
    transform.setIdentity();
    transform.setOrigin(to_bullet(Vector3(0, 0.25, z)));
    compound->addChildShape(transform, &beam);
  }
  land(std::move(compound), turned(0.7, Vector3::UnitY()), 0.5);
}

INSTANTIATE_TEST_SUITE_P(World, Landing, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
