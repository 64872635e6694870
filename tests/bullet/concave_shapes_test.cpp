// Soft bodies and Bullet's concave shapes other than a plain mesh: all have two sides.
#include "bullet/meshes.h"

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

namespace penalty::testing {
namespace {

using std::numbers::pi;

class Concave : public WorldTest {
 protected:
  // Falls towards -y or +y onto a shape whose surface is at height `top` there.
  void lie(Simulation& other, btRigidBody& rigid, Real top, Real down) {
    other.set_gravity({0, 9.81 * down, 0});
    const Real mesh_margin = rigid.getCollisionShape()->getMargin(), margin = 0.02;
    btSoftBody& body = other.add_jelly(cube, jelly_with(margin, {-0.2, down < 0 ? top + 0.2 : top - 0.6, -0.2}));
    const auto height = [&](const Vector3& x) { return -down * (x.y() - top); };
    for (int k = 0; k < 120; ++k) {
      other.step(frame);
      ASSERT_TRUE(other.penalty().report(body).finite);
      ASSERT_GT(least(body, height), 0) << "in step " << k;
    }
    EXPECT_NEAR(least(body, height), mesh_margin + margin, 2e-3);
  }

  const TetMesh cube = make_box({0.4, 0.4, 0.4}, {4, 4, 4});
};

TEST_P(Concave, ScaledMeshesAreTwoSided) {
  for (const bool turned : {false, true})
    for (const Real down : {-1.0, 1.0})
      for (const Real sign : {1.0, -1.0}) {
        Simulation other(GetParam());
        MeshShape mesh(turned ? sheet_mesh(1, 1, 4).turned() : sheet_mesh(1, 1, 4), 0.04);
        btRigidBody& rigid = other.add_rigid(
            std::make_unique<btScaledBvhTriangleMeshShape>(&mesh, btVector3(2, static_cast<btScalar>(sign), 2)), 0,
            {0, 0.5, 0});
        lie(other, rigid, 0.5, down);
      }
}

TEST_P(Concave, MeshesInCompoundsAreTwoSided) {
  for (const bool turned : {false, true})
    for (const Real down : {-1.0, 1.0}) {
      Simulation other(GetParam());
      const MeshData sheet = sheet_mesh(1, 2, 4).shifted({0, 0, 1});
      MeshShape left(turned ? sheet.turned() : sheet, 0), right(turned ? sheet : sheet.turned(), 0);
      auto compound = std::make_unique<btCompoundShape>();
      btTransform transform;
      transform.setIdentity();
      transform.setOrigin(btVector3(-1, 1, -1));
      compound->addChildShape(transform, &left);
      transform.setRotation(btQuaternion(btVector3(0, 1, 0), static_cast<btScalar>(pi)));
      transform.setOrigin(btVector3(1, 1, 1));
      compound->addChildShape(transform, &right);
      compound->setMargin(0);
      lie(other, other.add_rigid(std::move(compound), 0, {0, -0.5, 0}), 0.5, down);
    }
}

TEST_P(Concave, HeightfieldsAreTwoSidedAsTheyAreForRigidBodies) {
  const std::vector<float> heights(81, 0);
  for (const bool turned : {false, true})
    for (const Real down : {-1.0, 1.0}) {
      SCOPED_TRACE(::testing::Message() << (turned ? "turned" : "") << " gravity " << down);
      Simulation other(GetParam());
      btRigidBody& field = other.add_rigid(
          std::make_unique<btHeightfieldTerrainShape>(9, 9, heights.data(), btScalar(-1), btScalar(1), 1, turned), 0,
          {0, 0, 0});
      btRigidBody& box = other.add_box({0.2, 0.2, 0.2}, 1, {1.5, -0.4 * down, 1.5});
      lie(other, field, 0, down);
      EXPECT_NEAR(Real(box.getWorldTransform().getOrigin().y()), -0.2 * down, 0.06) << "Bullet's own";
    }
}

// A ridge beneath the triangles of a coarse body, between its nodes, is taken away.
TEST_P(Concave, AnEditedHeightfieldHoldsNothingWhereItWas) {
  std::vector<float> heights(81, 0);
  for (int row = 0; row < 9; ++row) heights[9 * row + 4] = 0.5F;
  Simulation other(GetParam());
  other.set_gravity({0, -9.81, 0});
  other.add_rigid(
      std::make_unique<btHeightfieldTerrainShape>(9, 9, heights.data(), btScalar(-1), btScalar(1), 1, false), 0,
      {0, 0, 0});
  const btSoftBody& body =
      other.add_jelly(make_box({3, 0.4, 1}, {1, 1, 1}), {.stiffness = 1000,
                                                         .shift = {-1.5, 0.6, -0.5},
                                                         .body = {.margin = 0.02, .friction = 1},
                                                         .attach = {.step = {.damping_time = 0.02}}});
  const auto lowest = [&] {
    Real low = 1;
    for (int i = 0; i < body.m_nodes.size(); ++i) low = std::min(low, Real(body.m_nodes[i].m_x.y()));
    return low;
  };
  for (int k = 0; k < 60; ++k) other.step(frame);
  EXPECT_GT(lowest(), 0.4);
  std::fill(heights.begin(), heights.end(), 0.0F);
  for (int k = 0; k < 120; ++k) other.step(frame);
  EXPECT_NEAR(lowest(), 0.04, 0.05);
}

TEST_P(Concave, ADynamicMeshIsCarried) {
  for (const bool turned : {false, true}) {
    Simulation other(GetParam());
    btGImpactCollisionAlgorithm::registerAlgorithm(static_cast<btCollisionDispatcher*>(other.world().getDispatcher()));
    other.set_gravity({0, -9.81, 0});
    other.add_ground();
    btTriangleMesh triangles;
    const MeshData box = turned ? box_mesh({0.3, 0.1, 0.3}).turned() : box_mesh({0.3, 0.1, 0.3});
    for (const auto& [a, b, c] : box.triangles)
      triangles.addTriangle(to_bullet(box.vertices[a]), to_bullet(box.vertices[b]), to_bullet(box.vertices[c]));
    auto shape = std::make_unique<btGImpactMeshShape>(&triangles);
    shape->setMargin(btScalar(0.01));
    shape->updateBound();
    btSoftBody& body = other.add_jelly(make_box({1, 0.4, 1}, {10, 4, 10}), jelly_with(0.02, {-0.5, 0.02, -0.5}));
    btRigidBody& rigid = other.add_rigid(std::move(shape), 2, {0.02, 0.62, 0.01});
    for (int k = 0; k < 180; ++k) {
      other.step(frame);
      ASSERT_TRUE(other.penalty().report(body).finite);
    }
    EXPECT_NEAR(Real(rigid.getWorldTransform().getOrigin().y()), 0.42 + 0.03 + 0.1, 0.03);
    EXPECT_LT(Real(rigid.getLinearVelocity().length()), 0.05);
  }
}

INSTANTIATE_TEST_SUITE_P(World, Concave, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
