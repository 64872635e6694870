// The part of ImplicitContacts that works on anchors.
#include <algorithm>
#include <limits>

#include "contact_rules.h"
#include "implicit_contacts.h"

namespace penalty {
namespace {

constexpr Real share_taken_back = 0.2;  // in a step, of the way between a particle and its anchor

// What the anchor gave in the last step; null: it was none.
const RememberedContact* find_anchor(const std::vector<RememberedContact>& memory, const Anchor& anchor) {
  for (auto known = std::ranges::lower_bound(memory, anchor.a.point.particles, {}, &RememberedContact::particles);
       known != memory.end() && known->particles == anchor.a.point.particles; ++known)
    if (known->normal == anchor.b.anchor) return &*known;
  return nullptr;
}

}  // namespace

// What is taken back comes no faster than depth.
void ImplicitContacts::add_anchors() {
  for (const Anchor& anchor : island_.anchors) {
    const SteppedBody& body = *island_.bodies[anchor.a.body];
    RigidBody& rigid = island_.rigid_bodies[anchor.b.rigid];
    Row row{.anchor = &anchor, .soft_a = anchor.a.body, .b = &rigid};
    row.place = anchor.a.point.of(body.particles.positions);
    row.arm_b = row.place - rigid.position;
    row.sides.add(anchor.a.point, 1, first_of(row.soft_a));
    row.start = row.sides.distance_of_particles(from_);
    row.limit = std::numeric_limits<Real>::infinity();
    if (const RememberedContact* known = find_anchor(body.implicit.anchors, anchor)) row.rubbing = known->force;
    const std::size_t before = rows_.size();
    add(row, std::numeric_limits<Real>::infinity(), 0, true);
    if (rows_.size() == before) continue;
    const Vector3 apart = row.place - rigid.position - rigid.rotation * anchor.b.anchor;
    const Vector3 back = no_longer_than(recovery_speed * duration_, Vector3(-share_taken_back * apart));
    rows_.back().way += back;
    rows_.back().driven += back;
  }
}

// As a rigid body has turned by now: an arc is no small part of the way of what is light and hangs on it.
Vector3 ImplicitContacts::bent_way(const Row& row, const PackedVectors& x) const {
  if (!row.anchor || row.sides.num_rigid == 0) return row.way;
  return row.driven + bend_of(x.col(row.sides.rigid[0].column + 1).head<3>(), row.arm_b);
}

}  // namespace penalty
