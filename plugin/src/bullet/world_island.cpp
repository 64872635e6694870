#include "world_island.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>

#include "couplings.h"
#include "held_bodies.h"

namespace penalty {

void WorldIsland::absorb(WorldIsland& from) {
  std::vector<int> renumbered;
  for (const TouchedRigidBody& other : from.touched) {
    const auto known =
        std::find_if(touched.begin(), touched.end(), [&](const TouchedRigidBody& t) { return t.key == other.key; });
    renumbered.push_back(static_cast<int>(known - touched.begin()));
    if (known == touched.end()) touched.push_back(other);
  }
  const auto first = static_cast<int>(held.size());
  for (Contact contact : from.contacts) {
    for (Side* side : {&contact.a, &contact.b})
      if (side->is_rigid())
        side->rigid = renumbered[side->rigid];
      else
        side->body += first;
    contacts.push_back(contact);
  }
  for (Anchor anchor : from.anchors) {
    anchor.a.body += first;
    anchor.b.rigid = renumbered[anchor.b.rigid];
    anchors.push_back(anchor);
  }
  held.insert(held.end(), from.held.begin(), from.held.end());
  couplings.insert(couplings.end(), from.couplings.begin(), from.couplings.end());
  for (HeldPair pair : from.surfaces) {
    if (pair.touched >= 0) pair.touched = renumbered[pair.touched];
    surfaces.push_back(pair);
  }
  for (RigidContact contact : from.rigid_contacts) {
    contact.a = renumbered[contact.a];
    contact.b = renumbered[contact.b];
    rigid_contacts.push_back(contact);
  }
  for (HeldJoint joint : from.joints) {
    for (int* body : {&joint.a, &joint.b, &joint.joint.a, &joint.joint.b})
      if (*body >= 0) *body = renumbered[*body];
    joints.push_back(joint);
  }
  if (!solver_info) solver_info = from.solver_info;
  from = {};
}

bool WorldIsland::shares_a_rigid_body_with(const WorldIsland& other) const {
  for (const TouchedRigidBody& first : touched)
    for (const TouchedRigidBody& second : other.touched)
      if (first.start.is_dynamic() && (first.key == second.key || are_of_one_multibody(*first.object, *second.object)))
        return true;
  return false;
}

void WorldIsland::advance(Real duration, Island& island) {
  island.bodies.clear();
  for (HeldBody* body : held) island.bodies.push_back(&body->stepped);
  island.rigid_bodies.clear();
  for (const TouchedRigidBody& t : touched) island.rigid_bodies.push_back(t.start);
  island.contacts = contacts;
  island.anchors = anchors;
  island.rigid_contacts = rigid_contacts;
  island.impacts = impacts;
  island.surfaces.clear();
  for (std::size_t k = 0; k < held.size(); ++k) held[k]->number = static_cast<int>(k);
  for (const auto& [pair, a, b, touched_by] : surfaces)
    island.surfaces.push_back({pair, a->number, b ? b->number : -1, touched_by});
  island.couplings.clear();
  for (HeldCoupling* coupling : couplings) {
    for (std::size_t k = 0; k < coupling->points.size(); ++k) {
      const HeldPoint& point = coupling->points[k];
      Side& side = coupling->stepped.points[k];
      if (point.soft) {
        side = Side::of_particles(point.soft->number, point.point.point);
      } else {
        const auto body = std::find_if(touched.begin(), touched.end(),
                                       [&](const TouchedRigidBody& t) { return t.body == point.rigid; });
        side = Side::of_rigid(static_cast<int>(body - touched.begin()), point.point.anchor);
      }
    }
    const std::uint64_t version = coupling->field.stiffness_version();
    estimate_stability(coupling->stepped, island, version != coupling->estimated_version);
    coupling->estimated_version = version;
    island.couplings.push_back(&coupling->stepped);
  }
  const StepReport report = advance_with_joints(duration, island);
  rigid_contacts = island.rigid_contacts;
  impacts = island.impacts;
  if (!report.finite) joints.clear();
  hand_out(duration, island.records);
}

StepReport WorldIsland::advance_with_joints(Real duration, Island& island) {
  island.joints.clear();
  if (joints.empty()) return penalty::advance(island, duration);
  for (const HeldJoint& joint : joints) island.joints.push_back(joint.joint);
  JointRows rows(joints, touched, *solver_info, duration);
  island.joint_source = &rows;
  const StepReport report = penalty::advance(island, duration);
  island.joint_source = nullptr;
  for (std::size_t k = 0; k < joints.size(); ++k) joints[k].joint = island.joints[k];
  return report;
}

// A contact of two soft bodies, be they one, is one of each.
void WorldIsland::hand_out(Real duration, std::span<const ContactRecord> records) {
  for (const HeldBody* body : held) body->contacts->begin_step(duration);
  for (const ContactRecord& record : records) {
    HeldBody& body = *held[record.body];
    BodyContact contact{.point = record.point,
                        .normal = record.normal,
                        .impulse = record.impulse,
                        .gap = record.gap,
                        .slides = record.slides};
    if (record.other_rigid >= 0) {
      body.contacts->add(*touched[record.other_rigid].object, contact);
      continue;
    }
    HeldBody& other = *held[record.other_body];
    body.contacts->add(*other.body, contact);
    contact.normal *= -1;
    contact.impulse *= -1;
    other.contacts->add(*body.body, contact);
  }
}

}  // namespace penalty
