// Either of Bullet's soft-body worlds, set up and taken down in the right order: for scenes, tests and benchmarks.
#pragma once
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <memory>

#include "penalty/bullet/penalty_deformable_body_solver.h"
#include "penalty/bullet/penalty_soft_body_solver.h"
#include "scenes/scene_options.h"

namespace penalty::demo {

enum class SoftSolver { penalty, bullet };

/// A world with the plugin's solver in it, or with Bullet's own. Bodies belong to the caller, who removes them first.
class BulletWorld {
 public:
  explicit BulletWorld(WorldKind kind, SoftSolver solver = SoftSolver::penalty) {
    if (kind == WorldKind::classic) {
      auto& soft = solver == SoftSolver::penalty ? keep<btSoftBodySolver, PenaltySoftBodySolver>()
                                                 : keep<btSoftBodySolver, btDefaultSoftBodySolver>();
      auto world =
          std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher_, &broadphase_, &constraints_, &configuration_, &soft);
      classic_ = world.get();
      world_ = std::move(world);
    } else {
      auto& soft = solver == SoftSolver::penalty ? keep<btDeformableBodySolver, PenaltyDeformableBodySolver>()
                                                 : keep<btDeformableBodySolver, btDeformableBodySolver>();
      deformable_constraints_.setDeformableSolver(&soft);
      auto world = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &deformable_constraints_, &configuration_, &soft);
      deformable_ = world.get();
      world_ = std::move(world);
    }
    if (attached_) attached_->take_joints_of(*world_);
  }

  btDiscreteDynamicsWorld& world() { return *world_; }
  btDeformableMultiBodyDynamicsWorld& deformable() { return *deformable_; }
  btSoftBodyWorldInfo& info() { return classic_ ? classic_->getWorldInfo() : deformable_->getWorldInfo(); }
  bool has_plugin() const { return attached_; }
  AttachedBodies& attached() { return *attached_; }  // if it has the plugin

  /// Of soft bodies and rigid ones.
  void set_gravity(const btVector3& gravity) {
    world_->setGravity(gravity);
    info().m_gravity = gravity;
  }

  void add(btSoftBody& body) { classic_ ? classic_->addSoftBody(&body) : deformable_->addSoftBody(&body); }
  void remove(btSoftBody& body) { classic_ ? classic_->removeSoftBody(&body) : deformable_->removeSoftBody(&body); }

  void step(Real duration) { world_->stepSimulation(static_cast<btScalar>(duration), 0); }

 private:
  template <class Base, class Solver>
  Base& keep() {
    auto solver = std::make_unique<Solver>();
    if constexpr (std::is_base_of_v<AttachedBodies, Solver>) attached_ = solver.get();
    Base& base = *solver;
    solver_ = std::move(solver);
    return base;
  }

  // Destroyed from the last to the first: the world before what it points to.
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver constraints_;
  btDeformableMultiBodyConstraintSolver deformable_constraints_;
  std::unique_ptr<btSoftBodySolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  btSoftRigidDynamicsWorld* classic_ = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable_ = nullptr;
  AttachedBodies* attached_ = nullptr;
};

}  // namespace penalty::demo
