#include "body_anchors.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>

#include "convert.h"
#include "held_bodies.h"
#include "nodes.h"
#include "world_island.h"
#include "world_objects.h"

namespace penalty {

bool has_anchors(const btSoftBody& body) { return body.m_anchors.size() > 0 || body.m_deformableAnchors.size() > 0; }

std::vector<btCollisionObject*> held_together(btSoftBody& body, const WorldObjects& objects) {
  std::vector<btCollisionObject*> together{&body};
  const auto add = [&](const btCollisionObject* object) {
    if (objects.contain(object) && (!object->isStaticObject() || object->isKinematicObject()))
      together.push_back(const_cast<btCollisionObject*>(object));
  };
  for (int k = 0; k < body.m_anchors.size(); ++k) add(body.m_anchors[k].m_body);
  for (int k = 0; k < body.m_deformableAnchors.size(); ++k) add(body.m_deformableAnchors[k].m_cti.m_colObj);
  return together;
}

const char* read_anchors(HeldBody& held, const WorldObjects& objects) {
  const btSoftBody& body = *held.body;
  held.anchors.clear();
  const auto add = [&](const btSoftBody::Node* node, const btCollisionObject* object, const btVector3& local,
                       Real influence) -> const char* {
    const int number = index_of(body, node);
    if (number < 0) return "an anchor is of no node of it: append it again";
    if (!objects.contain(object)) return "what it is anchored to has left the world: remove the anchor, or put it back";
    if (!std::isfinite(local.length2()) || !std::isfinite(influence)) return "an anchor is not finite";
    if (influence > 0)
      held.anchors.push_back(
          {number, const_cast<btCollisionObject*>(object), to_vector(local), std::min<Real>(influence, 1)});
    return nullptr;
  };
  for (int k = 0; k < body.m_anchors.size(); ++k) {
    const btSoftBody::Anchor& anchor = body.m_anchors[k];
    if (const char* problem = add(anchor.m_node, anchor.m_body, anchor.m_local, Real(anchor.m_influence)))
      return problem;
  }
  for (int k = 0; k < body.m_deformableAnchors.size(); ++k) {
    const btSoftBody::DeformableNodeRigidAnchor& anchor = body.m_deformableAnchors[k];
    if (const char* problem = add(anchor.m_node, anchor.m_cti.m_colObj, anchor.m_local, 1)) return problem;
  }
  return nullptr;
}

bool is_anchored(const HeldBody& held, const WeightedPoint& point, const btCollisionObject& object) {
  const auto end = point.particles.begin() + point.size;
  return std::any_of(held.anchors.begin(), held.anchors.end(), [&](const HeldAnchor& anchor) {
    return anchor.object == &object && std::find(point.particles.begin(), end, anchor.node) != end;
  });
}

bool is_anchored(const HeldBody& held, const btCollisionObject& object) {
  return std::any_of(held.anchors.begin(), held.anchors.end(),
                     [&](const HeldAnchor& anchor) { return anchor.object == &object; });
}

void add_anchors(const HeldBody& held, const RigidBodies& rigid_bodies, WorldIsland& island) {
  for (const HeldAnchor& anchor : held.anchors) {
    const int touched = rigid_bodies.touch(*anchor.object, false, island.touched);
    island.anchors.push_back({.a = Side::of_particles(0, WeightedPoint::at_particle(anchor.node)),
                              .b = Side::of_rigid(touched, anchor.local),
                              .influence = anchor.influence});
  }
}

}  // namespace penalty
