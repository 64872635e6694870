#include "restitution.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "rigid_state.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr Real turned_share = 0.1;  // of the speed of arrival: slower approach is over
constexpr Real one_sided = 0.5;     // share of the impulses that must point one way
constexpr Real quiet_share = 0.1;   // of the impulses since a hit began: in a step that has no more the hit is over
constexpr Real longest_way = 2;     // in sizes of the body, after which it is no hit any more; a particle has none

std::tuple<int, int, int> impact_key(const Impact& impact) {
  return {impact.body, impact.other_body, impact.other_rigid};
}

struct FoundImpact {
  Impact* impact;
  Real sign;  // of what the record says of its body, on that of the impact
};

FoundImpact find_impact(Island& island, const ContactRecord& record) {
  Impact wanted{.body = record.body, .other_body = record.other_body, .other_rigid = record.other_rigid};
  const bool swapped = wanted.other_body >= 0 && wanted.other_body < wanted.body;
  if (swapped) std::swap(wanted.body, wanted.other_body);
  const auto found = std::ranges::lower_bound(island.impacts, impact_key(wanted), {}, impact_key);
  if (found == island.impacts.end() || impact_key(*found) != impact_key(wanted)) return {nullptr, 0};
  return {&*found, swapped ? Real(-1) : Real(1)};
}

Real pressing_of(const ContactRecord& record) { return std::max<Real>(record.normal.dot(record.impulse), 0); }

// A soft body as a rigid one. One that is held somewhere moves as what holds it.
RigidBody as_rigid(const SteppedBody& body, const PackedVectors& positions, const PackedVectors& velocities) {
  const std::vector<Real>& inverse_masses = body.particles.inverse_masses;
  RigidBody rigid;
  Real held = 0;
  for (std::size_t i = 0; i < inverse_masses.size(); ++i) {
    if (inverse_masses[i] > 0) continue;
    ++held;
    rigid.position += positions.col(static_cast<Eigen::Index>(i)).head<3>();
    rigid.velocity += velocities.col(static_cast<Eigen::Index>(i)).head<3>();
  }
  if (held > 0) {
    rigid.position /= held;
    rigid.velocity /= held;
    return rigid;
  }
  const RigidState state(positions, velocities, inverse_masses);
  rigid.position = state.center;
  rigid.velocity = state.momentum / state.mass;
  rigid.inverse_mass.setConstant(1 / state.mass);
  rigid.inverse_inertia = state.inverse_inertia();
  rigid.angular_velocity = rigid.inverse_inertia * state.spin;
  return rigid;
}

void move_rigidly(SteppedBody& body, const RigidBody& before, const RigidBody& after) {
  const Vector3 velocity = after.velocity - before.velocity, turn = after.angular_velocity - before.angular_velocity;
  for (int i = 0; i < body.particles.size(); ++i)
    body.particles.velocities.col(i).head<3>() +=
        velocity + turn.cross(Vector3(body.particles.positions.col(i).head<3>() - before.position));
}

/// A pair of bodies in this step.
class Hit {
 public:
  Hit(Island& island, Impact& impact) : island_(island), impact_(impact) {}

  /// Finds whether it begins, and takes what it cost in this step.
  void follow(Real duration);
  /// Gives back, if it is over.
  void finish();

 private:
  SteppedBody& body() const { return *island_.bodies[impact_.body]; }
  SteppedBody* other() const { return impact_.other_body < 0 ? nullptr : island_.bodies[impact_.other_body]; }

  void take_start();
  void take_end();
  Real loss_of(const SteppedBody& body) const;
  bool is_over(Real leaving) const;
  void give();
  void record(const Vector3& given);

  Vector3 at() const { return a_.position + impact_.arm; }
  Real leaving() const {
    const Vector3 of_b = b_.velocity_at(at() - b_.position);
    return impact_.normal.dot(a_.velocity_at(impact_.arm) - of_b);
  }

  Island& island_;
  Impact& impact_;
  RigidBody a_, b_;
};

void Hit::take_start() {
  const SteppedBody* soft = other();
  a_ = as_rigid(body(), body().start.positions, body().start.velocities);
  b_ = soft ? as_rigid(*soft, soft->start.positions, soft->start.velocities) : island_.rigid_start[impact_.other_rigid];
}

void Hit::take_end() {
  const SteppedBody* soft = other();
  a_ = as_rigid(body(), body().particles.positions, body().particles.velocities);
  b_ = soft ? as_rigid(*soft, soft->particles.positions, soft->particles.velocities)
            : island_.rigid_bodies[impact_.other_rigid];
}

// What the integrator gained by its errors is not given once more.
Real Hit::loss_of(const SteppedBody& body) const {
  const EnergyFlows& flows = body.step_flows;
  const Real expected = body.last_energy.value_or(0) + flows.received() - flows.lost();
  const Real error = body.elastic_energy + kinetic_energy(body.particles) - expected;
  return impact_.pressing / body.pressing * (flows.damping + flows.contact_loss + flows.integration - error);
}

void Hit::follow(Real duration) {
  const bool touched_before = std::exchange(impact_.touched, impact_.pressing > 0);
  if (!impact_.touched) return;
  const Real size = impact_.pressed.norm();
  if (!(size > one_sided * impact_.pressing)) {
    impact_.arrival = 0;
    return;
  }
  impact_.at /= impact_.pressing;
  impact_.normal = impact_.pressed / size;
  if (!touched_before) {
    take_start();
    impact_.arm = impact_.at - a_.position;
    const Real approach = -leaving();
    impact_.arrival = approach > restitution_threshold ? approach : 0;
    impact_.way = impact_.pressing_since = impact_.lost = 0;
  }
  const SteppedBody* soft = other();
  impact_.lost += loss_of(body()) + (soft ? loss_of(*soft) : 0);
  impact_.pressing_since += impact_.pressing;
  impact_.way += impact_.arrival * duration;
}

void Hit::finish() {
  if (!(impact_.arrival > 0)) return;
  take_end();
  if (impact_.touched) impact_.arm = impact_.at - a_.position;
  if (is_over(leaving())) {
    give();
    impact_.arrival = 0;
  } else if (body().size > 0 && impact_.way > longest_way * body().size) {
    impact_.arrival = 0;
  }
}

// It has left, or lies and is pressed by little more than its weight.
bool Hit::is_over(Real leaving) const {
  if (impact_.pressing == 0) return true;
  if (leaving < -turned_share * impact_.arrival) return false;
  return impact_.pressing < quiet_share * impact_.pressing_since || (leaving > 0 && !impact_.still_presses);
}

void Hit::give() {
  const Vector3 arm_b = at() - b_.position;
  const Real mobility = impact_.normal.dot((a_.mobility_at(impact_.arm) + b_.mobility_at(arm_b)) * impact_.normal);
  if (!(mobility > 0)) return;
  const Real e2 = impact_.restitution * impact_.restitution, arrival2 = impact_.arrival * impact_.arrival;
  const Real own = leaving(), returned2 = own > 0 ? own * own : 0;
  const Real wanted = std::sqrt(returned2 + e2 * std::max<Real>(arrival2 - returned2, 0));
  const Real energy = e2 * std::max<Real>(impact_.lost, 0);
  const Real size = std::min(wanted - own, std::sqrt(own * own + 2 * mobility * energy) - own) / mobility;
  if (!(size > 0) || !std::isfinite(size)) return;

  const Vector3 given = size * impact_.normal;
  const RigidBody a_before = a_, b_before = b_;
  const Real of_a = a_.push(given, impact_.arm);
  body().step_flows.contacts += of_a;
  move_rigidly(body(), a_before, a_);
  if (SteppedBody* soft = other()) {
    const Real of_b = b_.push(-given, arm_b);
    move_rigidly(*soft, b_before, b_);
    soft->step_flows.contacts += of_b;
    for (SteppedBody* of_pair : {&body(), soft}) of_pair->step_flows.contact_loss -= (of_a + of_b) / 2;
  } else {
    RigidBody& rigid = island_.rigid_bodies[impact_.other_rigid];
    body().step_flows.contact_loss -= size * own + size * size * mobility / 2;
    if (rigid.is_dynamic()) rigid.push(-given, arm_b);
  }
  record(given);
}

// Where the pair is still recorded it is part of that.
void Hit::record(const Vector3& given) {
  if (impact_.pressing == 0) {
    island_.records.push_back({.body = impact_.body,
                               .other_body = impact_.other_body,
                               .other_rigid = impact_.other_rigid,
                               .point = at(),
                               .normal = impact_.normal,
                               .impulse = given});
    return;
  }
  for (ContactRecord& record : island_.records)
    if (const auto [impact, sign] = find_impact(island_, record); impact == &impact_)
      record.impulse += sign * pressing_of(record) / impact_.pressing * given;
}

}  // namespace

void give_back(Island& island, Real duration) {
  if (island.impacts.empty()) return;
  for (Impact& impact : island.impacts) {
    impact.pressing = 0;
    impact.pressed = impact.at = Vector3::Zero();
    impact.still_presses = false;
  }
  for (SteppedBody* body : island.bodies) body->pressing = 0;
  for (const ContactRecord& record : island.records) {
    const Real size = pressing_of(record);
    island.bodies[record.body]->pressing += size;
    if (record.other_body >= 0 && record.other_body != record.body) island.bodies[record.other_body]->pressing += size;
    if (const auto [impact, sign] = find_impact(island, record); impact) {
      impact->pressing += size;
      impact->pressed += sign * size * record.normal;
      impact->at += size * record.point;
      impact->still_presses = impact->still_presses || record.still_presses;
    }
  }
  for (Impact& impact : island.impacts) Hit(island, impact).follow(duration);
  for (Impact& impact : island.impacts) Hit(island, impact).finish();  // after all, as it changes the books
}

}  // namespace penalty
