#include "implicit_surfaces.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr Real most_turning = 0.5;  // of a rigid body in a step [rad]

Matrix3 rotation_of(const Vector3& turn) {
  const Real angle = turn.norm();
  return angle > 0 ? Eigen::AngleAxis<Real>(angle, turn / angle).toRotationMatrix() : Matrix3::Identity();
}

}  // namespace

Eigen::Index column_of(const RigidBody& body, const Island& island) {
  if (!body.is_dynamic()) return -1;
  Eigen::Index column = 0;
  for (const SteppedBody* soft : island.bodies) column += soft->particles.size();
  for (const RigidBody& other : island.rigid_bodies) {
    if (&other == &body) break;
    if (other.is_dynamic()) column += 2;
  }
  return column;
}

bool ImplicitSurfaces::can_step(Real duration) const {
  for (const SurfaceContact& contact : island_.surfaces) {
    if (contact.pair->is_tangled()) return false;
    if (contact.rigid < 0) continue;
    const RigidBody& body = island_.rigid_bodies[contact.rigid];
    if (body.is_dynamic() ? duration * body.angular_velocity.norm() > most_turning : !body.is_at_rest()) return false;
  }
  for (const SteppedBody* body : island_.bodies)
    for (int i = 0; i < body->particles.size(); ++i)
      if (!(body->particles.inverse_masses[i] > 0) && !body->particles.velocities.col(i).isZero(0)) return false;
  return true;
}

void ImplicitSurfaces::begin(Eigen::Index num_columns) { at_.setZero(4, num_columns); }

void ImplicitSurfaces::undo() {
  surfaces_.forget();
  surfaces_.take_positions();
  for (const SurfaceContact& contact : island_.surfaces) contact.pair->begin_step();
}

Vector3 ImplicitSurfaces::center_of(const RigidBody& body) const {
  const Eigen::Index column = column_of(body, island_);
  return column < 0 ? body.position : Vector3(body.position + at_.col(column).head<3>());
}

void ImplicitSurfaces::refresh() {
  for (const SurfaceContact& contact : island_.surfaces) contact.pair->refresh(1, 1);
}

Real ImplicitSurfaces::aim(const PackedVectors& displacement) {
  surfaces_.visit_soft([&](ContactSurface& surface, const SteppedBody& body) {
    surface.take_velocities(displacement, body.implicit.first);
  });
  surfaces_.visit_rigid([&](ContactSurface& surface, const RigidBody& body) {
    const Eigen::Index column = column_of(body, island_);
    if (column < 0) return;
    const PackedVectors& by = displacement;
    surface.take_way_to(center_of(body) + by.col(column).head<3>(),
                        rotation_of((at_.col(column + 1) + by.col(column + 1)).head<3>()) * body.rotation);
  });
  refresh();
  Real share = 1;
  visit_near([&](const SurfaceContact& contact, FeaturePair& q, Real reach) {
    share = std::min(share, contact.pair->separated_share(q, 1, reach));
  });
  return share;
}

bool ImplicitSurfaces::meet(const PackedVectors& displacement) {
  begin(displacement.cols());
  bool do_meet = aim(displacement) < 1;
  visit_near([&do_meet](const SurfaceContact& contact, FeaturePair& q, Real reach) {
    if (do_meet || q.distance > q.thickness + reach) return;
    const ClosestPoints closest = contact.pair->find_closest(q);
    Vector3 way = Vector3::Zero();
    for (int k = 0; k < 4; ++k) way += closest.weights[k] * contact.pair->surface_of(q, k).velocity(q.points[k]);
    do_meet = q.distance + contact.pair->direction(q, closest).dot(way) < q.thickness;
  });
  return do_meet;
}

void ImplicitSurfaces::pass(const PackedVectors& from) {
  surfaces_.visit_soft([&from](ContactSurface& surface, const SteppedBody& body) {
    const Eigen::Index first = body.implicit.first, count = body.particles.size();
    surface.take_velocities(PackedVectors(body.particles.positions - from.middleCols(first, count)));
  });
  take_ways_to_rigid_bodies();
  surfaces_.drift(1);
  surfaces_.take_positions();
}

void ImplicitSurfaces::take_ways_to_rigid_bodies() {
  surfaces_.visit_rigid(
      [](ContactSurface& surface, const RigidBody& body) { surface.take_way_to(body.position, body.rotation); });
}

void ImplicitSurfaces::move(Real share, const PackedVectors& x) {
  surfaces_.drift(share);
  at_ = x;
  surfaces_.visit_soft(
      [&](ContactSurface& surface, const SteppedBody& body) { surface.take_positions(x, body.implicit.first); });
  surfaces_.visit_rigid([&](ContactSurface& surface, const RigidBody& body) {
    if (const Eigen::Index column = column_of(body, island_); column >= 0)
      surface.take_positions(center_of(body), rotation_of(x.col(column + 1).head<3>()) * body.rotation);
  });
}

bool ImplicitSurfaces::end() {
  bool is_separated = true;
  surfaces_.visit_soft([](ContactSurface& surface, const SteppedBody& body) {
    surface.take_velocities(PackedVectors::Zero(4, body.particles.size()));
  });
  take_ways_to_rigid_bodies();
  refresh();
  visit_near([&](const SurfaceContact& contact, FeaturePair& q, Real reach) {
    is_separated = is_separated && contact.pair->separated_share(q, 1, reach) == 1;
  });
  surfaces_.drift(1);
  surfaces_.take_positions();
  return is_separated;
}

Real ImplicitSurfaces::distance_at_start(const SurfaceContact& contact, const FeaturePair& q) const {
  const SurfacePair& pair = *contact.pair;
  std::array<Vector3, 4> x;
  for (int k = 0; k < 4; ++k) {
    const bool is_of_first = k < (q.are_edges ? 2 : 1);
    const ContactSurface& surface = pair.surface_of(q, k);
    if (surface.is_rigid()) {
      const RigidBody& body = island_.rigid_bodies[contact.rigid];
      x[k] = body.position + body.rotation * surface.rest_position(q.points[k]);
    } else {
      const int body = is_of_first == q.from_b ? contact.body_b : contact.body_a;
      x[k] = surface.points()[q.points[k]].of(island_.bodies[body]->particles.positions);
    }
  }
  return (q.are_edges ? closest_points_of_edges(x[0], x[1], x[2], x[3])
                      : closest_points_of_triangle(x[0], x[1], x[2], x[3]))
      .difference.norm();
}

void ImplicitSurfaces::report() {
  merge(island_.surface_scratch->records);
  visit_near([this](const SurfaceContact& contact, FeaturePair& q, Real reach) {
    const ClosestPoints closest = contact.pair->find_closest(q);
    if (q.are_edges && !closest.is_interior && !q.is_lone) return;
    if (q.distance > q.thickness + reach) return;
    ++island_.surface_scratch->num_touching;
    book_touching(island_, contact.body_a, contact.body_b, q.thickness - q.distance);
  });
}

}  // namespace penalty
