#include "penalty/bullet/penalty_deformable_body_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "body_settings.h"
#include "face_tree.h"
#include "world_step.h"

namespace penalty {

PenaltyDeformableBodySolver::PenaltyDeformableBodySolver() = default;
PenaltyDeformableBodySolver::~PenaltyDeformableBodySolver() = default;

bool PenaltyDeformableBodySolver::all_attached() const {
  for (int k = 0; k < m_softBodies.size(); ++k)
    if (!is_attached(*m_softBodies[k])) return false;
  return true;
}

// Bullet's prediction goes over all that are awake; what makes a body be held, it would spread.
void PenaltyDeformableBodySolver::predict_others(btScalar time_step) {
  const auto for_each_held = [this](const auto& call) {
    for (btSoftBody* body : listed(m_softBodies))
      if (HeldBody* held = attached_->bodies->find(*body); held && held->outcome == StepOutcome::held) call(*held);
  };
  for_each_held([](HeldBody& held) {
    held.activation_state = held.body->getActivationState();
    held.body->forceActivationState(ISLAND_SLEEPING);
  });
  btDeformableBodySolver::predictMotion(time_step);
  for_each_held([](HeldBody& held) { held.body->forceActivationState(held.activation_state); });
}

// Between soft bodies that are attached there is contact already: Bullet's would add to it. It stays with its flag where a
// body that is not attached has the flag, too.
void PenaltyDeformableBodySolver::switch_off_soft_contact() {
  constexpr int flag = btSoftBody::fCollision::VF_DD;
  const std::span<btSoftBody* const> bodies = listed(m_softBodies);
  if (std::any_of(bodies.begin(), bodies.end(), [this](const btSoftBody* body) {
        return !is_attached(*body) && (body->m_cfg.collisions & flag) != 0;
      }))
    return;
  for (btSoftBody* body : bodies)
    if (HeldBody* held = attached_->bodies->find(*body)) {
      held->switched_off = body->m_cfg.collisions & flag;
      body->m_cfg.collisions &= ~flag;
    }
}

void PenaltyDeformableBodySolver::predictMotion(btScalar time_step) {
  switch_off_soft_contact();
  const std::span<btSoftBody* const> bodies = listed(m_softBodies);
  const auto stepped = attached_->step(bodies, time_step, true);
  // As Bullet does before it predicts, but with a tree over the faces that is always made, and made in time.
  for (HeldBody* held : stepped) {
    update_constants(*held->body);
    keep_face_tree(*held->body);
  }
  // What Bullet's prediction does to ours is overwritten below.
  if (!all_attached()) predict_others(time_step);

  for (HeldBody* held : stepped) {
    btSoftBody& body = *held->body;
    Particles& particles = held->stepped.particles;
    if (body.m_cfg.drag > 0) particles.velocities *= 1 - Real(body.m_cfg.drag);
    if (!stays_in_range(*held)) continue;
    held->nodes.write_mean_velocities(particles, held->stepped.start.positions, time_step, Vector3::Zero());
    held->nodes.forget_contacts();
    predictDeformableMotion(&body, time_step);
    held->nodes.remember_velocities();
  }
  attached_->freeze_held(bodies);
}

// Anchors of attached bodies are in the step, and so are joints: Bullet does not see them.
void PenaltyDeformableBodySolver::setConstraints(const btContactSolverInfo& info) {
  attached_->joints.hide();
  std::vector<std::pair<btSoftBody*, decltype(btSoftBody::m_deformableAnchors)>> hidden;
  for (btSoftBody* body : listed(m_softBodies))
    if (is_attached(*body) && body->m_deformableAnchors.size() > 0) {
      hidden.emplace_back(body, body->m_deformableAnchors);
      body->m_deformableAnchors.clear();
    }
  btDeformableBodySolver::setConstraints(info);
  for (const auto& [body, anchors] : hidden) body->m_deformableAnchors.copyFromArray(anchors);
}

void PenaltyDeformableBodySolver::solveDeformableConstraints(btScalar time_step) {
  attached_->joints.show();
  if (all_attached())
    updateVelocity();
  else
    btDeformableBodySolver::solveDeformableConstraints(time_step);
}

void PenaltyDeformableBodySolver::applyTransforms(btScalar time_step) {
  const std::span<btSoftBody* const> bodies = listed(m_softBodies);
  attached_->freeze_held(bodies);  // again: Bullet moves all by their velocities, whatever its contacts made of these
  if (!all_attached() && std::isfinite(time_step)) btDeformableBodySolver::applyTransforms(time_step);
  attached_->thaw_held(bodies);
  for (btSoftBody* body : bodies) {
    HeldBody* held = attached_->bodies->find(*body);
    if (!held) continue;
    body->m_cfg.collisions |= std::exchange(held->switched_off, 0);
    if (held->outcome == StepOutcome::none) continue;
    if (held->outcome == StepOutcome::stepped) {  // also a body that Bullet's islands have sent to sleep since then
      // The mean velocity was written, so a change of it is what contacts between soft bodies did.
      if (held->nodes.read_velocity_changes(held->stepped.particles, time_step)) held->stepped.positions_changed();
      report_rejected(*held);
      stays_in_range(*held);
      held->nodes.write(held->stepped.particles);
    }
    body->interpolateRenderMesh();
  }
  attached_->correct_rigid_bodies(time_step);
  attached_->tell_contacts();
}

void PenaltyDeformableBodySolver::processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) {
  if (!is_attached(*body)) btDeformableBodySolver::processCollision(body, object);
}

void PenaltyDeformableBodySolver::processCollision(btSoftBody* body, btSoftBody* other) {
  if (!is_attached(*body) || !is_attached(*other)) btDeformableBodySolver::processCollision(body, other);
}

}  // namespace penalty
