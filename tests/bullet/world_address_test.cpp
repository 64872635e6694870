// A solver that outlives its world.
#include "math/random.h"  // before Bullet, one of whose headers has a global called seed

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <optional>

#include "bullet/simulation.h"
#include "penalty/bullet/penalty_soft_body_solver.h"

namespace penalty::testing {
namespace {

// Bullet calls back before it solves soft bodies: joints that are in our step are to be on again by then.
TEST(WorldAddress, JointsOfANewWorldAtTheAddressOfTheOldOneAreOnWhenTheApplicationLooks) {
  PenaltySoftBodySolver solver;
  std::optional<btSoftRigidDynamicsWorld> world;
  const TetMesh mesh = make_box({1, 0.2, 1}, {3, 1, 3});
  for (int round = 0; round < 2; ++round) {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver constraints;
    world.emplace(&dispatcher, &broadphase, &constraints, &configuration, &solver);
    solver.take_joints_of(*world);
    const auto jelly = make_soft_body(world->getWorldInfo(), mesh, SoftBodyOptions{});
    world->addSoftBody(jelly.get());
    solver.attach(*jelly, make_elastic_field(mesh.vertices, mesh.tetrahedra, 10.0));
    btBoxShape shape(btVector3(btScalar(0.3), btScalar(0.05), btScalar(0.3)));
    btRigidBody plate(1, nullptr, &shape, btVector3(1, 1, 1));
    plate.setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(btScalar(0.5), btScalar(0.27), btScalar(0.5))));
    world->addRigidBody(&plate);
    btPoint2PointConstraint joint(plate, btVector3(0, 0, 0));
    world->addConstraint(&joint);
    int seen_off = 0;
    const auto look = [](btDynamicsWorld* looked_at, btScalar) {
      *static_cast<int*>(looked_at->getWorldUserInfo()) += !looked_at->getConstraint(0)->isEnabled();
    };
    world->setInternalTickCallback(look, &seen_off);
    for (int k = 0; k < 10; ++k) world->stepSimulation(btScalar(1.0 / 60), 0);
    EXPECT_EQ(seen_off, 0) << "round " << round;
    EXPECT_LT((to_vector(plate.getWorldTransform().getOrigin()) - Vector3(0.5, 0.27, 0.5)).norm(), 1e-4);
    world->removeConstraint(&joint);
    world->removeRigidBody(&plate);
    solver.detach(*jelly);
    world->removeSoftBody(jelly.get());
    world.reset();
  }
}

}  // namespace
}  // namespace penalty::testing
