// Bullet's queries meet attached bodies where their faces are; Bullet's flags for contact between soft bodies change nothing.
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include "bullet/simulation.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

constexpr Real none = 2;

class Queries : public WorldTest {
 protected:
  // The share of the way from `from` to `to` at which the world says that the body is hit; `none`: it is not.
  Real hit(const btSoftBody& body, const Vector3& from, const Vector3& to) {
    btCollisionWorld::ClosestRayResultCallback closest(to_bullet(from), to_bullet(to));
    sim.world().rayTest(to_bullet(from), to_bullet(to), closest);
    return closest.m_collisionObject == &body ? Real(closest.m_closestHitFraction) : none;
  }

  // The same by all faces of the body, as the intersection with a plane seen against the three edges.
  static Real expected_hit(const btSoftBody& body, const Vector3& from, const Vector3& to) {
    Real first = none;
    for (int k = 0; k < body.m_faces.size(); ++k) {
      std::array<Vector3, 3> x;
      for (int i = 0; i < 3; ++i) x[i] = to_vector(body.m_faces[k].m_n[i]->m_x);
      const Vector3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
      const Real share = normal.dot(x[0] - from) / normal.dot(to - from);
      const Vector3 at = from + share * (to - from);
      bool inside = share >= 0 && share <= 1;
      for (int i = 0; i < 3; ++i) inside = inside && normal.dot((x[(i + 1) % 3] - x[i]).cross(at - x[i])) >= 0;
      if (inside) first = std::min(first, share);
    }
    return first;
  }

  // Rays from above and from the side, off the edges of the mesh.
  void expect_hits(const btSoftBody& body) {
    const auto& [low, high] = bounds(body);
    int hits = 0;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const Vector3 share((i + 0.37) / 8, (j + 0.21) / 8, (i + 0.37) / 8);
        const Vector3 at = low + (high - low).cwiseProduct(share), tilt(0.05, 0.03, -0.04);
        for (const Vector3& way : {Vector3(0, -9, 0), Vector3(9, 0, 0)}) {
          const Vector3 side = way.normalized().cwiseAbs();
          const Vector3 middle = at - side.cwiseProduct(at) + side.cwiseProduct((low + high) / 2);
          const Vector3 from = middle - way / 2, to = middle + way / 2 + tilt;
          const Real expected = expected_hit(body, from, to);
          EXPECT_NEAR(hit(body, from, to), expected, limit(1e-9, 1e-4));
          hits += expected != none;
        }
      }
    EXPECT_GT(hits, 10);
  }

 private:
  static std::pair<Vector3, Vector3> bounds(const btSoftBody& body) {
    Vector3 low = to_vector(body.m_nodes[0].m_x), high = low;
    for (int i = 1; i < body.m_nodes.size(); ++i) {
      low = low.cwiseMin(to_vector(body.m_nodes[i].m_x));
      high = high.cwiseMax(to_vector(body.m_nodes[i].m_x));
    }
    return {low, high};
  }
};

TEST_P(Queries, RaysHitBeforeTheFirstStep) {
  btSoftBody& body = sim.add_jelly(make_box({1, 0.5, 1}, {3, 2, 3}));
  btSoftBody::sRayCast result;
  ASSERT_TRUE(body.rayTest(btVector3(0.4f, 1.5f, 0.3f), btVector3(0.4f, -0.5f, 0.3f), result));
  EXPECT_NEAR(Real(result.fraction), 0.5, 1e-5);
  expect_hits(body);
}

TEST_P(Queries, RaysFollowABodyThatFallsAndLands) {
  sim.set_gravity({0, -9.81, 0});
  sim.add_ground();
  btSoftBody& body = sim.add_jelly(make_box({1, 0.5, 1}, {3, 2, 3}), {.shift = {0, 1, 0}});
  for (int k = 1; k <= 90; ++k) {
    sim.step(exact_frame);
    if (k <= 20) {
      const Real top = 1.5 - 9.81 * (k * exact_frame) * (k * exact_frame) / 2;
      EXPECT_NEAR(hit(body, {0.4, 2, 0.3}, {0.4, -2, 0.3}), (2 - top) / 4, limit(1e-9, 1e-5)) << "frame " << k;
    }
    if (k % 10 == 0) expect_hits(body);
  }
}

TEST_P(Queries, RaysFollowABodyThatTurns) {
  btSoftBody& body = sim.add_jelly(make_torus(0.7, 0.3, 2, 12));
  for (int i = 0; i < body.m_nodes.size(); ++i)
    body.m_nodes[i].m_v = btVector3(2, 0, 3).cross(body.m_nodes[i].m_x) + btVector3(1, 1, 0);
  for (int k = 0; k < 5; ++k) {
    sim.step(exact_frame, 8);
    expect_hits(body);
  }
}

TEST_P(Queries, RaysHitBodiesOfSeveralPieces) {
  TetMesh pieces = make_box({0.5, 0.5, 1}, {2, 2, 3});
  const TetMesh other = moved(pieces, {1, 0.3, 0});
  const auto first = static_cast<int>(pieces.vertices.cols());
  Eigen::Matrix3Xd vertices(3, 2 * first);
  vertices << pieces.vertices, other.vertices;
  pieces.vertices = vertices;
  for (const auto& [a, b, c, d] : other.tetrahedra)
    pieces.tetrahedra.push_back({first + a, first + b, first + c, first + d});
  btSoftBody& body = sim.add_jelly(pieces);
  sim.step(exact_frame, 3);
  expect_hits(body);
}

TEST_P(Queries, RaysHitFacesThatWereAdded) {
  btSoftBody& body = sim.add_jelly(make_box({1, 0.5, 1}, {1, 1, 1}));
  for (int k = 0; k < 40; ++k) body.appendFace(0, 1, 6);
  sim.step(exact_frame);
  expect_hits(body);
}

TEST_P(Queries, RaysPassBodiesWithoutFaces) {
  std::unique_ptr<btSoftBody> made(
      btSoftBodyHelpers::CreateRope(sim.info(), btVector3(0, 0, 0), btVector3(1, 0, 0), 6, 0));
  btSoftBody& rope = sim.add(std::move(made));
  Eigen::Matrix3Xd rest(3, rope.m_nodes.size());
  for (int i = 0; i < rope.m_nodes.size(); ++i) rest.col(i) = to_vector(rope.m_nodes[i].m_x);
  sim.penalty().attach(rope, PotentialField(rest));
  sim.step(exact_frame);
  EXPECT_EQ(hit(rope, {0.5, 1, 0}, {0.5, -1, 0}), none);
}

TEST_P(Queries, ContactAndSweepTestsReturn) {
  btSoftBody& body = sim.add_jelly(make_box({1, 0.5, 1}, {3, 2, 3}));
  btRigidBody& box = sim.add_box({0.2, 0.2, 0.2}, 0, {0.5, 0.65, 0.5});
  struct Count final : btCollisionWorld::ContactResultCallback {
    btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      return ++count, btScalar(0);
    }
    int count = 0;
  } count;
  const btSphereShape ball(btScalar(0.1));
  const btTransform from(btMatrix3x3::getIdentity(), btVector3(0.9f, 2, 0.9f));
  const btTransform to(btMatrix3x3::getIdentity(), btVector3(0.9f, -2, 0.9f));
  for (int k = 0; k < 3; ++k) {
    sim.world().contactTest(&body, count);
    sim.world().contactPairTest(&body, &box, count);
    btCollisionWorld::ClosestConvexResultCallback swept(from.getOrigin(), to.getOrigin());
    sim.world().convexSweepTest(&ball, from, to, swept);
    EXPECT_FALSE(swept.hasHit()) << "sweeps see no soft bodies";
    sim.step(exact_frame);
  }
  EXPECT_EQ(count.count, 0) << "nor has Bullet manifolds for them";
  EXPECT_TRUE(sim.penalty().report(body).finite);
}

INSTANTIATE_TEST_SUITE_P(World, Queries, both_worlds(), param_name);

// Two boxes that fall on each other, with some of Bullet's flags or without: bit for bit the same.
class Flags : public WorldTest {
 protected:
  std::vector<btVector3> positions_after(int flags, bool with_links) {
    Simulation of(GetParam());
    of.set_gravity({0, -9.81, 0});
    of.add_ground();
    std::vector<const btSoftBody*> bodies;
    for (const Real height : {0.05, 0.7}) {
      btSoftBody& body = of.add_jelly(make_box({1, 0.5, 1}, {3, 2, 3}), {.shift = {0.1 * height, height, 0}});
      bodies.push_back(&body);
      body.m_cfg.collisions |= flags;
      if (with_links)
        for (int k = 0; k < body.m_faces.size(); ++k)
          for (int i = 0; i < 3; ++i)
            body.appendLink(body.m_faces[k].m_n[i], body.m_faces[k].m_n[(i + 1) % 3], nullptr, true);
      if (flags & btSoftBody::fCollision::CL_SS) body.generateClusters(4);
    }
    of.step(exact_frame, 60);
    std::vector<btVector3> positions;
    for (const btSoftBody* body : bodies)
      for (int i = 0; i < body->m_nodes.size(); ++i) positions.push_back(body->m_nodes[i].m_x);
    return positions;
  }
};

TEST_P(Flags, OfContactBetweenSoftBodiesChangeNothing) {
  using Flag = btSoftBody::fCollision;
  for (const bool with_links : {false, true}) {
    const std::vector<btVector3> expected = positions_after(0, with_links);
    for (const int flags : {int(Flag::VF_SS), int(Flag::VF_DD), int(Flag::CL_SS), Flag::CL_SS | Flag::CL_SELF})
      EXPECT_EQ(positions_after(flags, with_links), expected) << "flags " << flags << ", links " << with_links;
  }
}

INSTANTIATE_TEST_SUITE_P(World, Flags, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
