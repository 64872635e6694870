// What Bullet says of contacts between rigid bodies, where soft ones are near: Bullet without us says what is right.
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

#include <functional>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

// A ground, and a bar of jelly on it, along x: what moves along its side is in its island, but not touched.
class BesideABar : public WorldTest {
 protected:
  static constexpr Real radius = 0.1;

  static void add_bar(Simulation& own, Solver solver) {
    own.set_gravity({0, -g, 0});
    own.add_ground(1);
    const TetMesh mesh = moved(make_box({3, 0.3, 0.3}, {20, 2, 2}), {-1, 0.021, 0});
    btSoftBody& bar = own.add(make_soft_body(own.info(), mesh, SoftBodyOptions{}));
    if (solver == Solver::penalty) own.penalty().attach(bar, make_elastic_field(mesh.vertices, mesh.tetrahedra, 10.0));
  }
  static btRigidBody& add_ball(Simulation& own, const Vector3& velocity, const Vector3& spin) {
    btRigidBody& ball =
        own.add_rigid(std::make_unique<btSphereShape>(btScalar(radius)), 0.5, {0, radius, -radius - 0.03});
    ball.setFriction(1);
    ball.setLinearVelocity(to_bullet(velocity));
    ball.setAngularVelocity(to_bullet(spin));
    return ball;
  }
};

TEST_P(BesideABar, ABallRollsAsFarAsWithoutUs) {
  const auto run = [](Solver solver) {
    Simulation own(GetParam(), solver);
    add_bar(own, solver);
    btRigidBody& ball = add_ball(own, {1, 0, 0}, {0, 0, -1 / radius});
    ball.setRollingFriction(btScalar(0.02));
    own.step(frame, 120);
    EXPECT_LT(Real(ball.getLinearVelocity().length()), 1e-3);
    return Real(ball.getWorldTransform().getOrigin().x());
  };
  const Real way = 1 / (2 * 0.02 * g / radius / 1.4);  // of a sphere that rolls
  EXPECT_NEAR(run(Solver::bullet), way, 0.12 * way) << "its iterations end";
  EXPECT_NEAR(run(Solver::penalty), way, 0.03 * way);
}

TEST_P(BesideABar, ABallSpinsAsLongAsWithoutUs) {
  const auto run = [](Solver solver) {
    Simulation own(GetParam(), solver);
    add_bar(own, solver);
    btRigidBody& ball = add_ball(own, {0, 0, 0}, {0, 20, 0});
    ball.setRollingFriction(btScalar(1e-3));
    ball.setSpinningFriction(btScalar(4e-3));
    own.step(frame, 30);
    return Real(ball.getAngularVelocity().y());
  };
  const Real left = 20 - 4e-3 * g / (0.4 * radius * radius) * 30 * frame;
  EXPECT_NEAR(run(Solver::bullet), left, 0.02 * 20);
  EXPECT_NEAR(run(Solver::penalty), left, 0.02 * 20);
}

// Bullet calls a function that has no object: what it is to do stands here.
std::function<void(btManifoldPoint&)> on_new_point;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)
bool tell_of_point(btManifoldPoint& point, const btCollisionObjectWrapper* /*a*/, int /*part_a*/, int /*index_a*/,
                   const btCollisionObjectWrapper* /*b*/, int /*part_b*/, int /*index_b*/) {
  on_new_point(point);
  return true;
}

class TellsOfPoints : public BesideABar {
 protected:
  void SetUp() override { gContactAddedCallback = tell_of_point; }
  void TearDown() override {
    gContactAddedCallback = nullptr;
    on_new_point = nullptr;
  }
};

TEST_P(TellsOfPoints, OnceInAStep) {
  for (const Solver solver : {Solver::bullet, Solver::penalty}) {
    Simulation own(GetParam(), solver);
    add_bar(own, solver);
    btRigidBody& box = own.add_box({0.1, 0.1, 0.1}, 1, {0, 0.1, -0.122});
    box.setCollisionFlags(box.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    int calls = 0;
    on_new_point = [&](btManifoldPoint&) { ++calls; };
    own.step(frame, 30);
    EXPECT_GT(calls, 30);
    EXPECT_LE(calls, 30 * 4) << "of each corner";
  }
}

INSTANTIATE_TEST_SUITE_P(World, BesideABar, both_worlds(), param_name);
INSTANTIATE_TEST_SUITE_P(World, TellsOfPoints, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
