#include "implicit_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "contact_rules.h"
#include "particle_contacts.h"
#include "rigid_contacts.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr Real hardness_share = 30;  // of the inertia and stiffness that a contact works against
constexpr Real hardening = 4;        // of a contact whose multiplier leaves
constexpr Real enough_less = 0.25;   // more than this of the gap that it began with
constexpr Real same_normal = 0.9;    // cosine, of a contact that is that of the last step

// The remembered contact of the same point that points the same way; null: none.
const RememberedContact* find(const std::vector<RememberedContact>& memory, const WeightedPoint& point,
                              const Vector3& normal) {
  const RememberedContact* best = nullptr;
  Real most = same_normal;
  for (auto known = std::ranges::lower_bound(memory, point.particles, {}, &RememberedContact::particles);
       known != memory.end() && known->particles == point.particles; ++known)
    if (const Real cosine = known->normal.dot(normal); cosine > most) {
      best = &*known;
      most = cosine;
    }
  return best;
}

Real mobility_of(const RigidBody* body, const Vector3& arm, const Vector3& direction) {
  return body && body->is_dynamic() ? direction.dot(body->mobility_at(arm) * direction) : 0;
}

}  // namespace

ImplicitContacts::ImplicitContacts(Island& island, const PackedVectors& from, ImplicitSurfaces* surfaces, Real duration)
    : ImplicitContacts(island, *island.bodies.front()->implicit.contact_scratch, from, surfaces, duration) {}

ImplicitContacts::ImplicitContacts(Island& island, ImplicitContactScratch& scratch, const PackedVectors& from,
                                   ImplicitSurfaces* surfaces, Real duration)
    : island_(island),
      from_(from),
      duration_(duration),
      surfaces_(surfaces),
      rows_(scratch.rows),
      old_rows_(scratch.old_rows),
      inverse_masses_(scratch.inverse_masses),
      shares_(scratch.shares),
      given_(scratch.given) {
  rows_.clear();
  given_.assign(island.bodies.size(), {});
  inverse_masses_.clear();
  for (const SteppedBody* body : island.bodies)
    inverse_masses_.insert(inverse_masses_.end(), body->particles.inverse_masses.begin(),
                           body->particles.inverse_masses.end());
  for (Contact& contact : island.contacts) {
    const ContactPlace place = place_of(contact, island);
    Row row{.contact = &contact, .soft_a = contact.a.body, .soft_b = contact.b.body};
    row.sides.add(contact.a.point, 1, first_of(row.soft_a));
    if (contact.b.is_rigid()) {
      row.b = &island.rigid_bodies[contact.b.rigid];
      row.arm_b = place.at - row.b->position;
    } else {
      row.sides.add(contact.b.point, -1, first_of(row.soft_b));
    }
    row.normal = place.normal;
    row.place = place.at;
    row.start = row.sides.distance_of_particles(from);
    row.friction = contact.friction;
    const std::vector<RememberedContact>& memory = island.bodies[row.soft_a]->implicit.contacts;
    if (const RememberedContact* known = find(memory, contact.a.point, row.normal)) start(row, known->force);
    add(row, place.gap, contact.deepest, contact.radius == 0);
  }
  for (RigidContact& contact : island.rigid_contacts) {
    const RigidContactPlace place = place_of(contact, island);
    Row row{.rigid = &contact, .a = &island.rigid_bodies[contact.a], .b = &island.rigid_bodies[contact.b]};
    row.arm_a = place.at - row.a->position;
    row.arm_b = place.at - row.b->position;
    row.normal = place.normal;
    row.friction = contact.friction;
    if (!contact.force.isZero(0)) start(row, contact.force);
    const auto place_of_row = static_cast<int>(rows_.size());
    add(row, place.gap, std::numeric_limits<Real>::infinity(), contact.radius == 0);
    if (static_cast<int>(rows_.size()) > place_of_row) add_turning(contact, place_of_row);
  }
  add_anchors();
  first_of_surfaces_ = rows_.size();
}

// From what it gave in the last step [N].
void ImplicitContacts::start(Row& row, const Vector3& force) {
  row.pressing = std::max<Real>(row.normal.dot(force), 0);
  row.limit = row.friction * row.pressing;
  row.rubbing = no_longer_than(row.limit, force - row.normal.dot(force) * row.normal);
  row.is_new = false;
}

// Against rolling, and about the normal.
void ImplicitContacts::add_turning(const RigidContact& contact, int presser) {
  for (const bool about : {false, true}) {
    Row row = rows_[presser];
    row.presser = presser;
    row.friction = about ? contact.spinning : contact.rolling;
    if (!(row.friction > 0)) continue;
    const Matrix3 along = row.normal * row.normal.transpose();
    row.across = about ? along : Matrix3(Matrix3::Identity() - along);
    row.sides.turn = true;
    row.pressing = 0;
    row.way.setZero();
    for (const auto& [body, sign] : {std::pair(row.a, 1), std::pair(row.b, -1)})
      if (!body->is_dynamic()) row.way -= sign * duration_ * body->angular_velocity;
    row.driven = row.way;
    row.limit = row.friction * rows_[presser].pressing;
    row.rubbing = no_longer_than(row.limit, row.across * contact.moment);
    rows_.push_back(row);
  }
}

// With what is left of it: the rigid bodies.
void ImplicitContacts::add(Row row, Real gap, Real deepest, bool bends) {
  bool moves = is_any_free(row.sides);
  for (const auto& [body, arm, sign] : {std::tuple(row.a, row.arm_a, 1), std::tuple(row.b, row.arm_b, -1)}) {
    if (!body) continue;
    const Vector3 way = -sign * way_of(*body, arm, bends);
    row.way += way;
    if (const auto column = static_cast<int>(column_of(*body, island_)); column >= 0)
      row.sides.rigid[row.sides.num_rigid++] = {.column = column, .sign = Real(sign), .arm = arm};
    else
      row.driven += way;
    moves = moves || body->is_dynamic();
  }
  if (!moves) return;
  // Depth comes back no faster than is good, and what is too deep stays.
  const Real depth = std::max<Real>(-gap, 0), recovered = depth <= deepest ? recovery_speed * duration_ : 0;
  row.gap = gap + std::max<Real>(depth - recovered, 0);
  row.across = Matrix3::Identity() - row.normal * row.normal.transpose();
  rows_.push_back(row);
}

bool ImplicitContacts::is_any_free(const ContactSides& sides) const {
  return std::any_of(sides.particles.begin(), sides.particles.begin() + sides.num_particles,
                     [this](int i) { return inverse_masses_[i] > 0; });
}

// What a point does on its arc beyond the way that is linear in the turn.
Vector3 ImplicitContacts::bend_of(const Vector3& turn, const Vector3& arm) {
  const Real angle = turn.norm();
  if (!(angle > 0)) return Vector3::Zero();
  return Eigen::AngleAxis<Real>(angle, turn / angle) * arm - arm - turn.cross(arm);
}

// Of a point at `arm` from the centre of a body: of one that takes no impulse, by drifting; of another what is beyond the
// linear part, as it turns now. `bends`: it goes on an arc, where velocities lead off it.
Vector3 ImplicitContacts::way_of(const RigidBody& body, const Vector3& arm, bool bends) const {
  const Vector3 turn = duration_ * body.angular_velocity;
  Vector3 way = body.is_dynamic() ? Vector3::Zero() : Vector3(duration_ * body.velocity_at(arm));
  return bends ? Vector3(way + bend_of(turn, arm)) : way;
}

// Points that share particles, as those of an embedded surface do, share what these give way by.
void ImplicitContacts::set_hardness() {
  const auto visit_free = [this](const Row& row, const auto& visit) {
    const ContactSides& sides = row.sides;
    for (int k = 0; k < sides.num_particles; ++k)
      if (inverse_masses_[sides.particles[k]] > 0) visit(sides.particles[k], sides.weights[k] * sides.weights[k]);
  };
  shares_.assign(inverse_masses_.size(), 0);
  for (const Row& row : rows_) visit_free(row, [this](int particle, Real weight2) { shares_[particle] += weight2; });
  for (Row& row : rows_) {
    if (row.presser >= 0) {
      const Matrix3 mobility = row.across * (row.a->inverse_inertia + row.b->inverse_inertia) * row.across;
      row.hardness = row.hardening * hardness_share * row.across.trace() / (duration_ * duration_ * mobility.trace());
      continue;
    }
    Real mobility = mobility_of(row.a, row.arm_a, row.normal) + mobility_of(row.b, row.arm_b, row.normal);
    if (row.anchor && row.b->is_dynamic()) mobility = row.b->mobility_at(row.arm_b).trace() / 3;
    if (row.soft_a != row.soft_b)
      for (const int k : {row.soft_a, row.soft_b})
        if (k >= 0 && island_.bodies[k]->implicit.newton.fixed().empty()) mobility += 1 / island_.bodies[k]->mass;
    Real softness = duration_ * duration_ * mobility;
    visit_free(row, [&](int particle, Real weight2) {
      const int k = row.soft_b >= 0 && (row.soft_a < 0 || is_of(particle, row.soft_b)) ? row.soft_b : row.soft_a;
      const ImplicitState& state = island_.bodies[k]->implicit;
      const Matrix3 stiffness = state.newton.stiffness_of(particle - static_cast<int>(state.first));
      softness += 3 * weight2 * std::max<Real>(shares_[particle], 1) / stiffness.trace();
    });
    row.hardness = row.hardening * hardness_share / softness;
  }
}

void ImplicitContacts::predict(const PackedVectors& targets, Real negligible_speed) {
  targets_ = &targets;
  negligible_speed_ = negligible_speed;
  for (Row& row : rows_) predict(row);
}

void ImplicitContacts::predict(Row& row) const {
  if (!row.is_new || row.presser >= 0 || !targets_) return;
  const Vector3 way = moved(row, *targets_);
  row.is_predicted = -row.normal.dot(way) > negligible_speed_ * duration_ && gap_of(row, way) < 0;
}

ImplicitContacts::Force ImplicitContacts::force_of(const Row& row, const Vector3& moved) const {
  Force result{Vector3::Zero(), 0, 0, 0};
  if (row.presser < 0) result.pressing = std::max<Real>(row.pressing - row.hardness * gap_of(row, moved), 0);
  result.force = result.pressing * row.normal;
  result.energy = (result.pressing * result.pressing - row.pressing * row.pressing) / (2 * row.hardness);
  if (!(row.limit > 0)) return result;
  const Vector3 wanted = row.rubbing - row.hardness * (row.across * moved);
  const Real size = wanted.norm();
  result.rubbing_share = size > row.limit ? row.limit / size : 1;
  result.force += result.rubbing_share * wanted;
  const Real rubbed = std::min(size, row.limit);
  result.energy += rubbed * (size - rubbed / 2) / row.hardness;
  return result;
}

Real ImplicitContacts::evaluate(const PackedVectors& x, PackedVectors& gradient) const {
  Real energy = 0;
  for (const Row& row : rows_) {
    const Force given = force_of(row, moved(row, x));
    energy += given.energy;
    if (!given.force.isZero(0)) row.sides.push(-given.force, gradient);
  }
  return energy;
}

void ImplicitContacts::linearize(const PackedVectors& x, std::vector<ContactStiffness>& stiffness,
                                 PackedVectors& forces) {
  were_predicted_ = false;
  for (Row& row : rows_) {
    const Vector3 way = moved(row, x);
    const Force given = force_of(row, way);
    row.force = given.force;
    Real pressed = given.pressing > 0 ? row.hardness : 0;
    if (row.is_predicted && pressed == 0) {
      const Vector3 pull = (row.pressing - row.hardness * gap_of(row, way)) * row.normal;
      row.sides.push(pull, forces);
      row.force += pull;
      pressed = row.hardness;
      were_predicted_ = true;
    }
    row.is_predicted = false;
    row.stiffness = pressed * row.normal * row.normal.transpose() + row.hardness * given.rubbing_share * row.across;
    if (pressed > 0 || given.rubbing_share > 0) stiffness.push_back({row.sides, row.stiffness});
  }
}

void ImplicitContacts::follow(Real length, const PackedVectors& direction, const PackedVectors& x) {
  for (Row& row : rows_) {
    const Vector3 way = length * row.sides.distance(direction);
    row.linear_pressing = row.normal.dot(row.force - row.stiffness * way);
  }
  if (surfaces_) surfaces_->move(length, x);
}

ImplicitContacts::Change ImplicitContacts::limit_change(const PackedVectors& x) const {
  Change change;
  for (const Row& row : rows_) {
    const Real limit = row.friction * std::max<Real>(pressing_of_limit(row), 0);
    if (row.presser < 0 && !row.anchor) {
      change.limits += std::abs(limit - row.limit);
      change.sum += limit;
    }
    const Vector3 way = moved(row, x) + row.way - bent_way(row, x);
    change.gap = std::max(change.gap, error_of(row, force_of(row, way), way));
  }
  return change;
}

void ImplicitContacts::update(const PackedVectors& x, bool converged, Real settled_gap) {
  for (Row& row : rows_) {
    row.way = bent_way(row, x);
    const Vector3 way = moved(row, x);
    const Force given = force_of(row, way);
    if (!row.anchor) row.limit = row.friction * std::max<Real>(pressing_of_limit(row), 0);
    if (!converged) continue;
    const Real gap = error_of(row, given, way);
    if (gap > settled_gap && gap > enough_less * row.last_gap) {
      row.hardness *= hardening;
      row.hardening *= hardening;
    }
    row.last_gap = gap;
    row.pressing = given.pressing;
    row.rubbing = no_longer_than(row.limit, given.force - given.pressing * row.normal);
  }
}

void ImplicitContacts::finish(const PackedVectors& x) {
  for (SteppedBody* body : island_.bodies) {
    body->implicit.contacts.clear();
    body->implicit.anchors.clear();
  }
  for (Row& row : rows_) {
    const Vector3 way = moved(row, x);
    const Force given = force_of(row, way);
    row.force = given.force;
    if (row.presser >= 0) {
      give_moment(row, given.force, way);
      continue;
    }
    if (row.rigid) {
      row.rigid->force = given.force;
      row.rigid->moment.setZero();
    }
    if (given.force.isZero(0)) continue;
    const Vector3 impulse = duration_ * given.force;
    for (const RigidBody* body : {row.a, row.b}) touch_immovable_ = touch_immovable_ || (body && !body->is_dynamic());
    // What a contact does against its obstacle is loss; the other way, depth comes back, or its multipliers were too much.
    outside_work_ += given.force.dot(row.driven) + std::max<Real>(given.force.dot(way), 0);
    if (row.a && row.a->is_dynamic()) row.a->give(impulse, row.arm_a.cross(impulse));
    if (row.b && row.b->is_dynamic()) row.b->give(-impulse, -row.arm_b.cross(impulse));
    if (row.rigid) continue;
    give_to_soft(row, given, way, x);
    if (row.anchor) {
      island_.bodies[row.soft_a]->implicit.anchors.push_back(
          {row.anchor->a.point.particles, row.anchor->b.anchor, given.force});
      continue;
    }
    const Vector3 rubbed = given.force - given.pressing * row.normal;
    const bool slides = is_at_limit(rubbed.norm(), row.friction * given.pressing);
    ContactImpulse sum;
    (row.contact ? row.contact->given : sum).add(row.normal, duration_ * given.pressing, duration_ * rubbed, slides);
    if (row.contact)
      island_.bodies[row.soft_a]->implicit.contacts.push_back(
          {row.contact->a.point.particles, row.normal, given.force});
    else
      island_.surface_scratch->records.push_back({row.features, row.thickness, sum});
  }
  for (SteppedBody* body : island_.bodies)
    for (std::vector<RememberedContact>* memory : {&body->implicit.contacts, &body->implicit.anchors})
      std::ranges::sort(*memory, {}, &RememberedContact::particles);
  remember_features();
}

void ImplicitContacts::give_to_soft(const Row& row, const Force& given, const Vector3& way, const PackedVectors& x) {
  const bool is_within = row.soft_a == row.soft_b, is_between = !is_within && row.soft_a >= 0 && row.soft_b >= 0;
  const Vector3 impulse = duration_ * given.force;
  for (const auto& [k, sign] : {std::pair(row.soft_a, 1), std::pair(row.soft_b, -1)}) {
    if (k < 0) continue;
    GivenInStep& sum = given_[k];
    for (int i = 0; i < row.sides.num_particles; ++i)
      if (const int particle = row.sides.particles[i]; !is_between || is_of(particle, k))
        sum.work += row.sides.weights[i] * given.force.dot((x.col(particle) - from_.col(particle)).head<3>());
    sum.loss += std::max<Real>(-given.force.dot(way), 0);
    if (is_within) break;
    sum.impulse += sign * impulse;
    sum.moment += sign * row.place.cross(impulse);
  }
}

bool ImplicitContacts::is_of(int particle, int body) const {
  const Eigen::Index first = first_of(body);
  return particle >= first && particle < first + island_.bodies[body]->particles.size();
}

void ImplicitContacts::give_moment(const Row& row, const Vector3& moment, const Vector3& way) {
  row.rigid->moment += moment;
  outside_work_ += moment.dot(row.driven) + std::max<Real>(moment.dot(way), 0);
  if (row.a->is_dynamic()) row.a->give(Vector3::Zero(), duration_ * moment);
  if (row.b->is_dynamic()) row.b->give(Vector3::Zero(), -duration_ * moment);
}

}  // namespace penalty
