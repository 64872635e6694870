#include "anchors.h"

#include <Eigen/LU>
#include <Eigen/QR>

#include "particle_contacts.h"

namespace penalty {
namespace {

constexpr Real share = 0.2;  // of the way to the anchor, that a drift takes back

}  // namespace

void Anchors::Row::push(const Vector3& given) {
  point->add_push(given, body->particles.inverse_masses, body->particles.velocities);
  if (rigid->is_dynamic()) rigid->push(-given, arm);
  impulse += given;
}

void Anchors::begin(Real h, Real since) {
  rows_.clear();
  for (const Anchor& anchor : island_.anchors) {
    Row& row = rows_.emplace_back();
    row.body = island_.bodies[anchor.a.body];
    row.point = &anchor.a.point;
    row.rigid = &island_.rigid_bodies[anchor.b.rigid];
    const Particles& particles = row.body->particles;
    row.arm = row.point->of(particles.positions) - row.rigid->position;
    row.start = row.relative_velocity();
    const Real point_mobility = row.point->mobility(particles.inverse_masses);
    if (point_mobility <= 0 && !row.rigid->is_dynamic()) continue;  // two that are held
    const Matrix3 mobility = point_mobility * Matrix3::Identity() + row.rigid->mobility_at(row.arm);
    row.inertia = point_mobility > 0 ? Matrix3(mobility.inverse())
                                     : Matrix3(mobility.completeOrthogonalDecomposition().pseudoInverse());
    Vector3 back = -share / h * (row.arm - row.rigid->rotation * anchor.b.anchor);
    if (const Real speed = back.norm(); speed > recovery_speed) back *= recovery_speed / speed;
    row.wanted = row.start + anchor.influence * (back - row.start);
  }
  if (forces_.size() != rows_.size()) return;
  for (std::size_t k = 0; k < rows_.size(); ++k)
    if (!rows_[k].inertia.isZero(0)) rows_[k].push(since * forces_[k]);
}

Real Anchors::sweep() {
  Real largest = 0;
  for (Row& row : rows_) {
    const Vector3 change = row.wanted - row.relative_velocity();
    const Vector3 impulse = row.inertia * change;
    if (impulse.isZero(0)) continue;
    largest = std::max(largest, change.norm());
    row.push(impulse);
  }
  return largest;
}

void Anchors::end(Real since) {
  forces_.clear();
  for (const Row& row : rows_) {
    const Vector3 relative = row.relative_velocity();
    outside_work_ += row.impulse.dot(relative) - driving_work(*row.point, row.impulse, row.body->particles);
    if (!row.rigid->is_dynamic()) outside_work_ += row.impulse.dot(row.rigid->velocity_at(row.arm));
    row.body->step_flows.contact_loss += row.impulse.dot(relative - row.start) / 2;
    forces_.push_back(since > 0 ? Vector3(row.impulse / since) : Vector3::Zero());
  }
}

void Anchors::begin_attempt() {
  outside_work_ = 0;
  forces_.clear();
}

}  // namespace penalty
