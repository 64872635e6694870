// Penalty forces under Bullet's own deformable solver.
#pragma once
#include <BulletSoftBody/btDeformableLagrangianForce.h>

#include <memory>
#include <string>
#include <vector>

#include "penalty/fields/potential_field.h"

namespace penalty {

/// A Lagrangian force for applications that keep Bullet's stock btDeformableBodySolver:
///
///     penalty::DeformablePenaltyForce force;
///     force.attach(*body, std::move(field));
///     world.addForce(body, &force);
///
/// The stock solver evaluates it once a step, so a stiff field needs a small time step in explicit mode; in implicit
/// mode (`setImplicit(true)`, which also wants `setUseProjection(true)` and a registered gravity force) the stiffness
/// is Gauss-Newton's. Contact of a stiff body stays as unstable as under Bullet's own forces, and momentum is not
/// exchanged exactly with rigid bodies, and nothing flows or breaks: PenaltyDeformableBodySolver has none of these
/// limits. Every object has a force type of its own, so Bullet never merges two of them. The world does not own the
/// force: remove the bodies from the world before the force goes. A deleted body need not be detached.
///
/// What Bullet calls never throws: on a body of which forces cannot be had, none acts, and `problem` says why.
class DeformablePenaltyForce final : public btDeformableLagrangianForce {
 public:
  /// `damping_time`: ratio of damping to stiffness along the constraint gradients [s]. Throws std::invalid_argument if
  /// it is negative or not finite.
  explicit DeformablePenaltyForce(Real damping_time = 0);
  ~DeformablePenaltyForce() override;

  /// Throws std::invalid_argument if the field has another number of particles than the body has nodes.
  void attach(btSoftBody& body, PotentialField field);
  void detach(const btSoftBody& body);

  /// What kept forces from the body in the last step, on one line; empty: nothing. Throws std::invalid_argument for a
  /// body that is not attached.
  std::string problem(const btSoftBody& body) const;

  // Forces of all attached bodies that were also added through world.addForce, at the trial positions m_q. Arrays are
  // indexed by Node::index and may be longer than the number of nodes.
  void addScaledForces(btScalar scale, TVStack& force) override;
  void addScaledExplicitForce(btScalar scale, TVStack& force) override;
  void addScaledDampingForce(btScalar scale, TVStack& force) override;
  void addScaledElasticForceDifferential(btScalar scale, const TVStack& dx, TVStack& df) override;
  void addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) override;
  void buildDampingForceDifferentialDiagonal(btScalar scale, TVStack& diagonal) override;
  void addScaledHessian(btScalar scale) override;
  double totalElasticEnergy(btScalar time_step) override;
  double totalDampingEnergy(btScalar time_step) override;
  double totalEnergy(btScalar time_step) override;
  btDeformableLagrangianForceType getForceType() override {
    return static_cast<btDeformableLagrangianForceType>(type_);
  }

 private:
  struct Attached;
  Attached* find(const btSoftBody& body) const;
  template <class Function>
  void for_each_active(const Function& function) noexcept;

  int type_;  // of this force alone
  Real damping_time_;
  std::vector<std::unique_ptr<Attached>> attached_;
};

}  // namespace penalty
