// The plugin in Bullet's classic world.
#pragma once
#include <BulletSoftBody/btDefaultSoftBodySolver.h>

#include "penalty/bullet/attached_bodies.h"

namespace penalty {

/// A solver for btSoftRigidDynamicsWorld, handed to its constructor:
///
///     penalty::PenaltySoftBodySolver solver;
///     btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraint_solver, &configuration, &solver);
///     ...
///     world.addSoftBody(body);
///     solver.attach(*body, std::move(field));
///
/// Attached bodies are stepped whole in `predictMotion`: contact with rigid bodies included, so Bullet's own contact
/// for them is switched off. All other soft bodies behave as under Bullet's default solver. Gravity is that of the
/// body's world info, not of the world. The solver outlives the world.
class PenaltySoftBodySolver : public btDefaultSoftBodySolver, public AttachedBodies {
 public:
  PenaltySoftBodySolver();
  ~PenaltySoftBodySolver() override;

  void optimize(btAlignedObjectArray<btSoftBody*>& bodies, bool force_update = false) override;
  void predictMotion(btScalar time_step) override;
  void solveConstraints(btScalar time_step) override;
  void updateSoftBodies() override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) override;
  void processCollision(btSoftBody* body, btSoftBody* other) override;

 private:
  void drop_removed();

  const btAlignedObjectArray<btSoftBody*>* of_world_ = nullptr;  // which Bullet copies at the start of the step
};

}  // namespace penalty
