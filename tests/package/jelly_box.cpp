// A box of jelly falls on the ground of a classic Bullet world.
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <cstdio>

#include "penalty/bullet/penalty_soft_body_solver.h"
#include "penalty/bullet/soft_body.h"
#include "penalty/fields/elastic_field.h"
#include "penalty/mesh/builders.h"

int main() {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraint_solver;
  penalty::PenaltySoftBodySolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraint_solver, &configuration, &solver);
  world.getWorldInfo().m_gravity = {0, -10, 0};

  btStaticPlaneShape ground_shape({0, 1, 0}, 0);
  btRigidBody ground(0, nullptr, &ground_shape);
  world.addRigidBody(&ground);

  penalty::TetMesh mesh = penalty::make_box({1, 1, 1}, {3, 3, 3});
  const penalty::Material foam{.young = 2e4, .density = 100, .damping = 0.01};
  penalty::PotentialField field = penalty::make_elastic_field(mesh.vertices, mesh.tetrahedra, foam);
  mesh.vertices.row(1).array() += 0.5;  // the start, half a metre above the ground
  const auto body = penalty::make_soft_body(world.getWorldInfo(), mesh, foam);
  world.addSoftBody(body.get());
  solver.attach(*body, std::move(field));

  for (int step = 0; step < 120; ++step) world.stepSimulation(1.f / 60, 0);

  const Eigen::VectorXd heights = solver.particles(*body).positions.row(1);
  std::printf("%zu-byte btScalar: after 2 s the box stands between %.3f and %.3f m\n", sizeof(btScalar),
              heights.minCoeff(), heights.maxCoeff());
  const bool stands =
      heights.minCoeff() > -0.05 && heights.minCoeff() < 0.1 && heights.maxCoeff() > 0.8 && heights.maxCoeff() < 1.1;

  world.removeSoftBody(body.get());
  world.removeRigidBody(&ground);
  return stands ? 0 : 1;
}
