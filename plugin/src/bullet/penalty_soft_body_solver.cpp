#include "penalty/bullet/penalty_soft_body_solver.h"

#include "convert.h"
#include "face_tree.h"
#include "sleeping.h"
#include "world_step.h"

namespace penalty {
namespace {

// What of Bullet's position constraints is left to an attached body: contacts with soft bodies that are not. Its links are
// replaced by the field, its anchors are in the step.
bool has_position_constraints(const btSoftBody& body) {
  return body.m_scontacts.size() > 0 || body.m_clusters.size() > 0;
}

// Without the tree over the faces that Bullet makes if it is to: ours serves as well.
void predict(btSoftBody& body, btScalar time_step) {
  const int collisions = body.m_cfg.collisions;
  body.m_cfg.collisions &= ~btSoftBody::fCollision::VF_SS;
  body.predictMotion(time_step);
  body.m_cfg.collisions = collisions;
  keep_face_tree(body);
}

void solve_position_constraints(btSoftBody& body) {
  btSoftBody::tPSolverArray sequence;
  sequence.copyFromArray(body.m_cfg.m_psequence);
  body.m_cfg.m_psequence.remove(btSoftBody::ePSolver::Linear);
  body.m_cfg.m_psequence.remove(btSoftBody::ePSolver::Anchors);
  body.solveConstraints();
  body.m_cfg.m_psequence.copyFromArray(sequence);
}

}  // namespace

PenaltySoftBodySolver::PenaltySoftBodySolver() = default;
PenaltySoftBodySolver::~PenaltySoftBodySolver() = default;

void PenaltySoftBodySolver::optimize(btAlignedObjectArray<btSoftBody*>& bodies, bool force_update) {
  of_world_ = &bodies;
  btDefaultSoftBodySolver::optimize(bodies, force_update);
}

void PenaltySoftBodySolver::predictMotion(btScalar time_step) {
  const std::span<btSoftBody* const> bodies = listed(m_softBodySet);
  for (btSoftBody* body : bodies)
    if (!is_attached(*body) && body->isActive()) body->predictMotion(time_step);

  const auto stepped = attached_->step(bodies, time_step, false);
  attached_->joints.hide();
  for (HeldBody* held : stepped) {
    btSoftBody& body = *held->body;
    Particles& particles = held->stepped.particles;
    if (body.m_cfg.kDP > 0) particles.velocities *= 1 - Real(body.m_cfg.kDP);
    if (!stays_in_range(*held)) continue;
    // Bullet's prediction keeps its bounds and trees, which are to follow the mean velocity; gravity it adds itself.
    const Vector3 gravity_dv = to_vector(body.getWorldInfo()->m_gravity) * Real(body.m_cfg.timescale * time_step);
    held->nodes.write_mean_velocities(particles, held->stepped.start.positions, time_step, gravity_dv);
    predict(body, time_step);
    // A start position from which the end velocity leads to the end position: whatever Bullet's position constraints
    // then do arrives as a change of that velocity.
    held->nodes.write(particles, body.m_sst.sdt);
  }
  attached_->freeze_held(bodies);
}

// Bullet's callback at the end of a step comes before its constraints are solved, and may have deleted bodies.
void PenaltySoftBodySolver::drop_removed() {
  if (!of_world_) return;
  for (int k = m_softBodySet.size() - 1; k >= 0; --k)
    if (of_world_->findLinearSearch(m_softBodySet[k]) == of_world_->size()) m_softBodySet.removeAtIndex(k);
}

void PenaltySoftBodySolver::solveConstraints(btScalar time_step) {
  drop_removed();
  attached_->joints.show();
  const std::span<btSoftBody* const> bodies = listed(m_softBodySet);
  for (btSoftBody* body : bodies) {
    HeldBody* held = attached_->bodies->find(*body);
    if (held && body->getActivationState() == ISLAND_SLEEPING) body->setZeroVelocity();
    if (!body->isActive()) continue;
    if (!held) {
      body->solveConstraints();
    } else if (held->outcome != StepOutcome::held && has_position_constraints(*body)) {
      solve_position_constraints(*body);
      held->nodes.positions_to_velocities(body->m_sst.isdt);
      attached_->read_solved(*held);
    }
    if (held) update_activation(*held, time_step);
  }
  attached_->thaw_held(bodies);
  attached_->correct_rigid_bodies(time_step);
}

// The last that Bullet does in a step.
void PenaltySoftBodySolver::updateSoftBodies() {
  btDefaultSoftBodySolver::updateSoftBodies();
  attached_->tell_contacts();
}

void PenaltySoftBodySolver::processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) {
  if (!is_attached(*body)) btDefaultSoftBodySolver::processCollision(body, object);
}

void PenaltySoftBodySolver::processCollision(btSoftBody* body, btSoftBody* other) {
  if (!is_attached(*body) || !is_attached(*other)) btDefaultSoftBodySolver::processCollision(body, other);
}

}  // namespace penalty
