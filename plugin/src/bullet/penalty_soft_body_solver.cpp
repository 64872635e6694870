#include "penalty/bullet/penalty_soft_body_solver.h"

#include "attached_world.h"
#include "convert.h"

namespace penalty {
namespace {

// What of Bullet's position constraints is left to an attached body: contacts with other soft bodies and anchors. Its links
// are replaced by the field.
bool has_position_constraints(const btSoftBody& body) {
  return body.m_anchors.size() > 0 || body.m_scontacts.size() > 0 || body.m_clusters.size() > 0;
}

void solve_position_constraints(btSoftBody& body) {
  btSoftBody::tPSolverArray sequence;
  sequence.copyFromArray(body.m_cfg.m_psequence);
  body.m_cfg.m_psequence.remove(btSoftBody::ePSolver::Linear);
  body.solveConstraints();
  body.m_cfg.m_psequence.copyFromArray(sequence);
}

}  // namespace

PenaltySoftBodySolver::PenaltySoftBodySolver() = default;
PenaltySoftBodySolver::~PenaltySoftBodySolver() = default;

void PenaltySoftBodySolver::predictMotion(btScalar time_step) {
  const std::span<btSoftBody* const> bodies(m_softBodySet.size() ? &m_softBodySet[0] : nullptr, m_softBodySet.size());
  for (btSoftBody* body : bodies)
    if (!attached_->find(*body) && body->isActive()) body->predictMotion(time_step);

  for (AttachedBody* attached : attached_->step(bodies, time_step, false)) {
    btSoftBody& body = *attached->body;
    Particles& particles = attached->stepped.particles;
    if (body.m_cfg.kDP > 0) particles.velocities *= 1 - Real(body.m_cfg.kDP);
    // Bullet's prediction keeps its bounds and trees, which are to follow the mean velocity; gravity it adds itself.
    const PackedVectors& start = attached->stepped.start.positions;
    const Vector3 gravity_dv = to_vector(body.getWorldInfo()->m_gravity) * Real(body.m_cfg.timescale * time_step);
    for (int i = 0; i < particles.size(); ++i) {
      const Vector3 mean = (particles.positions.col(i) - start.col(i)).head<3>() / Real(time_step);
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_v = to_bullet(Vector3(node.m_im > 0 ? mean - gravity_dv : mean));
    }
    body.predictMotion(time_step);
    // A start position from which the end velocity leads to the end position: whatever Bullet's position constraints then do
    // arrives as a change of that velocity.
    for (int i = 0; i < particles.size(); ++i) {
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_x = to_bullet(particles.positions.col(i));
      node.m_v = to_bullet(particles.velocities.col(i));
      node.m_q = node.m_x - node.m_v * body.m_sst.sdt;
      attached->remember(i);
    }
  }
}

void PenaltySoftBodySolver::solveConstraints(btScalar time_step) {
  for (int k = 0; k < m_softBodySet.size(); ++k) {
    btSoftBody& body = *m_softBodySet[k];
    if (!body.isActive()) continue;
    AttachedBody* attached = attached_->find(body);
    if (!attached) {
      body.solveConstraints();
    } else if (has_position_constraints(body)) {
      solve_position_constraints(body);
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        btSoftBody::Node& node = body.m_nodes[i];
        node.m_v = attached->written_velocities[i] + (node.m_x - attached->written_positions[i]) * body.m_sst.isdt;
      }
      attached->read_nodes();
    }
  }
  attached_->correct_rigid_bodies(time_step);
}

void PenaltySoftBodySolver::processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) {
  if (!attached_->find(*body)) btDefaultSoftBodySolver::processCollision(body, object);
}

void PenaltySoftBodySolver::processCollision(btSoftBody* body, btSoftBody* other) {
  btDefaultSoftBodySolver::processCollision(body, other);
}

}  // namespace penalty
