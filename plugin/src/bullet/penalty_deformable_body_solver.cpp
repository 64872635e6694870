#include "penalty/bullet/penalty_deformable_body_solver.h"

#include <algorithm>

#include "attached_world.h"
#include "convert.h"

namespace penalty {
namespace {

// Bullet's trees over faces and nodes serve contact between soft bodies. They take quadratic time to build, and where links
// do not connect all nodes their construction never ends: an attached body has them only if it asks for that contact.
void update_constants(btSoftBody& body) {
  if (!body.m_bUpdateRtCst) return;
  body.m_bUpdateRtCst = false;
  body.updateConstants();
  body.m_fdbvt.clear();
  if ((body.m_cfg.collisions & btSoftBody::fCollision::VF_DD) && body.m_links.size() > 0) body.initializeFaceTree();
}

}  // namespace

PenaltyDeformableBodySolver::PenaltyDeformableBodySolver() = default;
PenaltyDeformableBodySolver::~PenaltyDeformableBodySolver() = default;

bool PenaltyDeformableBodySolver::all_attached() const {
  for (int k = 0; k < m_softBodies.size(); ++k)
    if (!attached_->find(*m_softBodies[k])) return false;
  return true;
}

void PenaltyDeformableBodySolver::predictMotion(btScalar time_step) {
  const std::span<btSoftBody* const> bodies(m_softBodies.size() ? &m_softBodies[0] : nullptr, m_softBodies.size());
  const auto stepped = attached_->step(bodies, time_step, true);
  for (AttachedBody* attached : stepped) update_constants(*attached->body);
  // Bullet's prediction is for its own bodies; what it does to ours is overwritten below.
  if (!all_attached()) btDeformableBodySolver::predictMotion(time_step);

  for (AttachedBody* attached : stepped) {
    btSoftBody& body = *attached->body;
    Particles& particles = attached->stepped.particles;
    if (body.m_cfg.drag > 0) particles.velocities *= 1 - Real(body.m_cfg.drag);
    const PackedVectors& start = attached->stepped.start.positions;
    for (int i = 0; i < particles.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_x = attached->written_positions[i];
      node.m_v = to_bullet(Vector3((particles.positions.col(i) - start.col(i)).head<3>() / Real(time_step)));
      node.m_effectiveMass_inv = btMatrix3x3::getIdentity() * node.m_im;
    }
    body.m_nodeRigidContacts.resizeNoInitialize(0);
    body.m_faceRigidContacts.resizeNoInitialize(0);
    body.m_faceNodeContacts.resizeNoInitialize(0);
    body.m_faceNodeContactsCCD.resizeNoInitialize(0);
    predictDeformableMotion(&body, time_step);
    for (int i = 0; i < particles.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_vn = node.m_v;  // in implicit mode Bullet's solve starts from here
      attached->written_velocities[i] = node.m_v;
    }
  }
}

void PenaltyDeformableBodySolver::solveDeformableConstraints(btScalar time_step) {
  if (all_attached())
    updateVelocity();
  else
    btDeformableBodySolver::solveDeformableConstraints(time_step);
}

void PenaltyDeformableBodySolver::applyTransforms(btScalar time_step) {
  if (!all_attached()) btDeformableBodySolver::applyTransforms(time_step);
  for (int k = 0; k < m_softBodies.size(); ++k) {
    btSoftBody& body = *m_softBodies[k];
    AttachedBody* attached = attached_->find(body);
    if (!attached || !body.isActive()) continue;
    Particles& particles = attached->stepped.particles;
    bool moved = false;
    for (int i = 0; i < particles.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      // The mean velocity was written, so a change of it is what contacts between soft bodies did.
      const Vector3 dv = to_vector(node.m_v - attached->written_velocities[i]);
      const Vector3 shift = time_step * (dv + to_vector(node.m_splitv));
      if (!shift.isZero(0)) {
        particles.velocities.col(i).head<3>() += dv;
        particles.positions.col(i).head<3>() += shift;
        moved = true;
      }
      node.m_x = to_bullet(particles.positions.col(i));
      node.m_v = to_bullet(particles.velocities.col(i));
      node.m_q = node.m_x;
      node.m_vn = node.m_v;
      attached->remember(i);
    }
    if (moved) attached->stepped.positions_changed();
    body.interpolateRenderMesh();
  }
  attached_->correct_rigid_bodies(time_step);
}

void PenaltyDeformableBodySolver::processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) {
  if (!attached_->find(*body)) btDeformableBodySolver::processCollision(body, object);
}

}  // namespace penalty
