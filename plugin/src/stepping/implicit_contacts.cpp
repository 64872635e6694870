#include "implicit_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "contact_rules.h"
#include "particle_contacts.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr Real hardness_share = 30;  // of the inertia and stiffness that a contact works against
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

// Of a point at `arm` from the centre, by drifting: on an arc, where velocities lead off it.
Vector3 way_of(const RigidBody& rigid, const Vector3& arm, Real duration) {
  const Vector3 turn = duration * rigid.angular_velocity;
  const Real angle = turn.norm();
  Vector3 way = duration * rigid.velocity;
  if (angle > 0) way += Eigen::AngleAxis<Real>(angle, turn / angle) * arm - arm;
  return way;
}

}  // namespace

ImplicitContacts::ImplicitContacts(Island& island, std::vector<RememberedContact>& memory, Real duration)
    : body_(*island.bodies.front()), duration_(duration) {
  const Particles& particles = body_.particles;
  rows_.reserve(island.contacts.size());
  for (Contact& contact : island.contacts) {
    if (!(contact.a.point.mobility(particles.inverse_masses) > 0)) continue;
    const ContactPlace place = place_of(contact, island);
    const RigidBody& rigid = island.rigid_bodies[contact.b.rigid];
    Row& row = rows_.emplace_back();
    row.contact = &contact;
    row.normal = place.normal;
    row.start = place.at;
    row.way = way_of(rigid, place.at - rigid.position, duration);
    row.depth = std::max<Real>(-place.gap, 0);
    // Depth comes back no faster than is good, and what is too deep stays.
    const Real recovered = row.depth <= contact.deepest ? recovery_speed * duration : 0;
    row.gap = place.gap + std::max<Real>(row.depth - recovered, 0);
    row.friction = contact.friction;
    if (const RememberedContact* known = find(memory, contact.a.point, row.normal)) {
      row.pressing = std::max<Real>(row.normal.dot(known->force), 0);
      row.limit = row.friction * row.pressing;
      row.rubbing = no_longer_than(row.limit, known->force - row.normal.dot(known->force) * row.normal);
      row.is_new = false;
    }
  }
}

// Points that share particles, as those of an embedded surface do, share what these give way by.
void ImplicitContacts::set_hardness(const NewtonSolver& newton) {
  const auto visit_free = [this](const Row& row, const auto& visit) {
    const WeightedPoint& point = row.contact->a.point;
    for (int k = 0; k < point.size; ++k)
      if (body_.particles.inverse_masses[point.particles[k]] > 0)
        visit(point.particles[k], point.weights[k] * point.weights[k]);
  };
  shares_.assign(body_.particles.inverse_masses.size(), 0);
  for (const Row& row : rows_) visit_free(row, [this](int particle, Real weight2) { shares_[particle] += weight2; });
  const bool is_free = newton.fixed().empty();
  for (Row& row : rows_) {
    Real softness = is_free ? duration_ * duration_ / body_.mass : 0;
    visit_free(row, [&](int particle, Real weight2) {
      softness += 3 * weight2 * std::max<Real>(shares_[particle], 1) / newton.stiffness_of(particle).trace();
    });
    row.hardness = hardness_share / softness;
  }
}

void ImplicitContacts::predict(const PackedVectors& velocities, const PackedVectors& targets, Real negligible_speed) {
  for (Row& row : rows_) {
    const WeightedPoint& point = row.contact->a.point;
    const Real approach = -row.normal.dot(point.of(velocities) - row.way / duration_);
    row.is_predicted = row.is_new && approach > negligible_speed && gap_of(row, point.of(targets)) < 0;
  }
}

ImplicitContacts::Force ImplicitContacts::force_of(const Row& row, const Vector3& point) const {
  Force result{Vector3::Zero(), 0, 0, 0};
  result.pressing = std::max<Real>(row.pressing - row.hardness * gap_of(row, point), 0);
  result.force = result.pressing * row.normal;
  result.energy = (result.pressing * result.pressing - row.pressing * row.pressing) / (2 * row.hardness);
  if (!(row.limit > 0)) return result;
  Vector3 slip = point - row.start - row.way;
  slip -= row.normal.dot(slip) * row.normal;
  const Vector3 wanted = row.rubbing - row.hardness * slip;
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
    const WeightedPoint& point = row.contact->a.point;
    const Force given = force_of(row, point.of(x));
    energy += given.energy;
    if (given.force.isZero(0)) continue;
    for (int k = 0; k < point.size; ++k) gradient.col(point.particles[k]).head<3>() -= point.weights[k] * given.force;
  }
  return energy;
}

void ImplicitContacts::linearize(const PackedVectors& x, std::vector<ContactStiffness>& stiffness,
                                 PackedVectors& forces) {
  for (Row& row : rows_) {
    const WeightedPoint& point = row.contact->a.point;
    const Vector3 at = point.of(x);
    const Force given = force_of(row, at);
    row.force = given.force;
    const Matrix3 along = row.normal * row.normal.transpose();
    Real pressed = given.pressing > 0 ? row.hardness : 0;
    if (row.is_predicted && pressed == 0) {
      const Vector3 pull = (row.pressing - row.hardness * gap_of(row, at)) * row.normal;
      for (int k = 0; k < point.size; ++k) forces.col(point.particles[k]).head<3>() += point.weights[k] * pull;
      row.force += pull;
      pressed = row.hardness;
    }
    row.is_predicted = false;
    row.stiffness = pressed * along + row.hardness * given.rubbing_share * (Matrix3::Identity() - along);
    if (pressed > 0 || given.rubbing_share > 0) stiffness.push_back({point, row.stiffness});
  }
}

void ImplicitContacts::follow(Real length, const PackedVectors& direction) {
  for (Row& row : rows_)
    row.linear_pressing = row.normal.dot(row.force - length * (row.stiffness * row.contact->a.point.of(direction)));
}

ImplicitContacts::Change ImplicitContacts::limit_change(const PackedVectors& x) const {
  Change change;
  for (const Row& row : rows_) {
    const Real limit = row.friction * std::max<Real>(row.linear_pressing, 0);
    change.limits += std::abs(limit - row.limit);
    change.sum += limit;
    const Vector3 at = row.contact->a.point.of(x);
    if (force_of(row, at).pressing > 0) change.gap = std::max(change.gap, std::abs(gap_of(row, at)));
  }
  return change;
}

void ImplicitContacts::update(const PackedVectors& x, bool converged) {
  for (Row& row : rows_) {
    const Force given = force_of(row, row.contact->a.point.of(x));
    row.limit = row.friction * std::max<Real>(row.linear_pressing, 0);
    if (!converged) continue;
    row.pressing = given.pressing;
    row.rubbing = no_longer_than(row.limit, given.force - given.pressing * row.normal);
  }
}

void ImplicitContacts::finish(const PackedVectors& x, std::vector<RememberedContact>& memory) {
  memory.clear();
  for (Row& row : rows_) {
    const Vector3 at = row.contact->a.point.of(x);
    const Force given = force_of(row, at);
    if (given.force.isZero(0)) continue;
    const Vector3 moved = at - row.start, rubbed = given.force - given.pressing * row.normal;
    work_ += given.force.dot(moved);
    // What a contact does against its obstacle is loss; the other way, depth comes back, or its multipliers were too much.
    outside_work_ += given.force.dot(row.way) + std::max<Real>(given.force.dot(moved - row.way), 0);
    impulse_ += duration_ * given.force;
    row.contact->given.add(row.normal, duration_ * given.pressing, duration_ * rubbed,
                           is_at_limit(rubbed.norm(), row.friction * given.pressing));
    row.force = given.force;
    memory.push_back({row.contact->a.point.particles, row.normal, given.force});
  }
  std::ranges::sort(memory, {}, &RememberedContact::particles);
}

}  // namespace penalty
