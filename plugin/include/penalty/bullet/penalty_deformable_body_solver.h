// The plugin in Bullet's deformable world.
#pragma once
#include <BulletSoftBody/btDeformableBodySolver.h>

#include "penalty/bullet/attached_bodies.h"

namespace penalty {

/// A solver for btDeformableMultiBodyDynamicsWorld, handed to its constructor and to its constraint solver:
///
///     penalty::PenaltyDeformableBodySolver solver;
///     btDeformableMultiBodyConstraintSolver constraint_solver;
///     constraint_solver.setDeformableSolver(&solver);
///     btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraint_solver, &configuration, &solver);
///     ...
///     world.addSoftBody(body);
///     solver.attach(*body, std::move(field));
///
/// Attached bodies are stepped whole in `predictMotion`, as in PenaltySoftBodySolver, with the same results; they need
/// no Lagrangian force, not even gravity, which is that of the body's world info. All other deformable bodies, and
/// contact of attached ones with these, stay Bullet's.
class PenaltyDeformableBodySolver : public btDeformableBodySolver, public AttachedBodies {
 public:
  PenaltyDeformableBodySolver();
  ~PenaltyDeformableBodySolver() override;

  void predictMotion(btScalar time_step) override;
  void setConstraints(const btContactSolverInfo& info) override;
  void solveDeformableConstraints(btScalar time_step) override;
  void applyTransforms(btScalar time_step) override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) override;
  void processCollision(btSoftBody* body, btSoftBody* other) override;

 private:
  bool all_attached() const;
  void predict_others(btScalar time_step);
  void switch_off_soft_contact();
};

}  // namespace penalty
