// The part of ImplicitContacts that works on features of surfaces.
#include <algorithm>
#include <cmath>

#include "contact_rules.h"
#include "implicit_contacts.h"

namespace penalty {
namespace {

constexpr Real near_share = 1;        // of the thickness: what is so near may touch
constexpr Real fitting_share = 0.05;  // of the thickness, that a gap may differ from its linear model

constexpr auto features_key = [](const auto& row) { return row.features.key(); };

}  // namespace

const ImplicitContacts::Row* ImplicitContacts::row_of(std::span<const Row> rows, const TouchingFeatures& features) {
  const auto found = std::ranges::lower_bound(rows, features.key(), {}, features_key);
  return found != rows.end() && found->features.are(features) ? &*found : nullptr;
}

void ImplicitContacts::take_surfaces(const PackedVectors& x) {
  if (!surfaces_) return;
  const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(first_of_surfaces_);
  old_rows_.assign(first, rows_.end());
  rows_.erase(first, rows_.end());
  surfaces_->visit_near([&](const SurfaceContact& contact, FeaturePair& q, Real reach) { add(contact, q, reach, x); });
  std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(first_of_surfaces_), rows_.end(),
            [](const Row& l, const Row& r) { return features_key(l) < features_key(r); });
  is_cut_ = false;
}

// What was lost of the thickness before the step comes back no faster than is good.
Real ImplicitContacts::kept_distance(const SurfaceContact& contact, const FeaturePair& q) const {
  const Real lost = std::max<Real>(q.thickness - surfaces_->distance_at_start(contact, q), 0);
  const Real thickness = q.thickness - contact.pair->b().radius();
  const Real recovery = (lost - lost_share * thickness) / std::max(recovery_time, duration_);
  return q.thickness - lost + duration_ * std::clamp<Real>(recovery, 0, lost_thickness_speed);
}

void ImplicitContacts::add(const SurfaceContact& contact, FeaturePair& q, Real reach, const PackedVectors& x) {
  const SurfacePair& pair = *contact.pair;
  const ClosestPoints closest = pair.find_closest(q);
  if (q.are_edges && !closest.is_interior && !q.is_lone) return;  // points and triangles are as near
  if (q.distance > q.thickness + reach) return;
  Row row{.features = features_of(island_, contact, q)};
  row.normal = pair.direction(q, closest);
  if (row.normal.isZero(0)) return;
  Vector3 at = Vector3::Zero(), approach = Vector3::Zero();
  for (int k = 0; k < 4; ++k) {
    const ContactSurface& surface = pair.surface_of(q, k);
    approach += closest.weights[k] * surface.velocity(q.points[k]);
    if (surface.is_rigid()) continue;
    const bool is_of_first = k < (q.are_edges ? 2 : 1);
    int& body = is_of_first ? row.soft_a : row.soft_b;
    body = is_of_first == q.from_b ? contact.body_b : contact.body_a;
    row.sides.add(surface.points()[q.points[k]], closest.weights[k], first_of(body));
    at += std::abs(closest.weights[k]) * surface.position(q.points[k]);
  }
  if (row.soft_a >= 0 && row.soft_b >= 0) at /= 2;
  const Real near = near_share * (q.thickness - pair.b().radius());
  if (q.distance > q.thickness + near - std::min<Real>(row.normal.dot(approach), 0)) return;
  bool moves = is_any_free(row.sides);
  row.place = at;
  row.friction = pair.friction();
  row.start = row.sides.distance_of_particles(from_);
  if (contact.rigid >= 0) {
    RigidBody& body = island_.rigid_bodies[contact.rigid];
    const bool is_first = pair.first(q).is_rigid();
    const Vector3 arm = at - surfaces_->center_of(body);
    (is_first ? row.a : row.b) = &body;
    (is_first ? row.arm_a : row.arm_b) = arm;
    row.place = body.position + arm;
    if (const Eigen::Index column = column_of(body, island_); column >= 0) {
      row.sides.rigid[row.sides.num_rigid++] = {
          .column = static_cast<int>(column), .sign = is_first ? Real(1) : Real(-1), .arm = arm};
      moves = true;
    }
  }
  if (!moves) return;
  row.across = Matrix3::Identity() - row.normal * row.normal.transpose();
  row.thickness = q.thickness;
  row.kept = kept_distance(contact, q);
  row.gap = q.distance - row.kept - row.normal.dot(moved(row, x));
  if (const Row* old = row_of(old_rows_, row.features)) {
    row.pressing = old->pressing;
    row.limit = old->limit;
    row.rubbing = no_longer_than(row.limit, old->rubbing - row.normal.dot(old->rubbing) * row.normal);
    row.hardening = old->hardening;
    row.last_gap = old->last_gap;
    row.is_new = old->is_new;
    row.memory = old->memory;
  } else {
    row.memory = q.memory;
    if (!q.memory.is_empty()) start(row, q.memory.start(1));
    predict(row);
  }
  rows_.push_back(row);
}

bool ImplicitContacts::fit(const PackedVectors& x) {
  bool fits = true;
  if (surfaces_)
    surfaces_->visit_near([&](const SurfaceContact& contact, FeaturePair& q, Real) {
      if (!fits) return;
      const ClosestPoints closest = contact.pair->find_closest(q);
      if (q.are_edges && !closest.is_interior && !q.is_lone) return;
      const Real tolerance = fitting_share * (q.thickness - contact.pair->b().radius());
      if (const Row* row = row_of(rows_of_surfaces(), features_of(island_, contact, q))) {
        const Real gap = q.distance - row->kept, linear = gap_of(*row, moved(*row, x));
        fits = std::abs(gap - linear) <= tolerance || std::min(gap, linear) > tolerance;
      } else if (q.distance < q.thickness - tolerance) {
        fits = q.distance > kept_distance(contact, q) - tolerance;
      }
    });
  return fits;
}

Real ImplicitContacts::longest(const PackedVectors& direction) {
  if (!surfaces_) return 1;
  const Real share = surfaces_->aim(direction);
  is_cut_ = share < 1;
  return share;
}

// What is not a row, is not near, or was not for a while: what it remembers is of another step.
void ImplicitContacts::remember_features() {
  if (!surfaces_) return;
  for (const SurfaceContact& contact : island_.surfaces) contact.pair->forget_memory();
  surfaces_->visit_near([this](const SurfaceContact& contact, FeaturePair& q, Real) {
    if (const Row* row = row_of(rows_of_surfaces(), features_of(island_, contact, q))) {
      q.memory = row->memory;
      q.memory.keep(duration_ * row->force, row->normal, duration_);
    }
  });
}

}  // namespace penalty
