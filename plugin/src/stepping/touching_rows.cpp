// The part of SurfaceContacts that works on the rows of touching pairs.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "contact_rules.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr Real least_mobility = 1e-6;  // that is left without turning, relative to all along the normal

using Vector2 = Eigen::Vector2<Real>;

Vector2 in_cone(const TouchingPair& pair, const Vector2& rubbed) {
  return no_longer_than(pair.friction * pair.given, rubbed);
}

void forget(TouchingPair& pair) {
  pair.given = 0;
  pair.rubbed.setZero();
}

}  // namespace

// The rotation that an angular momentum of the particles amounts to.
struct SurfaceContacts::Turning {
  Vector3 center;
  Matrix3 inverse_inertia;
};

// None where something is held, which takes up any moment, and for particles in one line, which have no moment about it.
std::optional<SurfaceContacts::Turning> SurfaceContacts::turning_of(const TouchingPair& pair) const {
  Real mass = 0;
  Vector3 center = Vector3::Zero();
  for (const TouchingParticle& p : particles_of(pair)) {
    if (!(p.inverse_mass > 0)) return std::nullopt;
    mass += 1 / p.inverse_mass;
    center += vector(p.position) / p.inverse_mass;
  }
  center /= mass;
  Matrix3 inertia = Matrix3::Zero();
  for (const TouchingParticle& p : particles_of(pair)) {
    const Vector3 arm = vector(p.position) - center;
    inertia += (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose()) / p.inverse_mass;
  }
  constexpr Real singular = 1e-9;
  const Real trace = inertia.trace();
  if (!(inertia.determinant() > singular * trace * trace * trace)) return std::nullopt;
  return Turning{center, inertia.inverse()};
}

// `turning`: without the rotation that its impulse would give.
void SurfaceContacts::make_row(const TouchingPair& pair, int row, const std::optional<Turning>& turning) {
  const Vector3 direction = pair.axes.col(row);
  for (TouchingParticle& p : particles_of(pair)) p.rows.col(row) = p.weight * direction;
  if (!turning) return;
  const Vector3 turn = turning->inverse_inertia * pair.difference.cross(direction);
  for (TouchingParticle& p : particles_of(pair))
    p.rows.col(row) -= turn.cross(vector(p.position) - turning->center) / p.inverse_mass;
}

void SurfaceContacts::make_normal_row(TouchingPair& pair) {
  make_row(pair, 0, std::nullopt);
  pair.mobility = mobility_of(pair, 0, 0);
  if (!pair.leads_out || pair.rigid) return;
  make_row(pair, 0, turning_of(pair));
  const Real mobility = mobility_of(pair, 0, 0);
  pair.mobility = mobility > least_mobility * pair.mobility ? mobility : 0;
}

// A pinned particle and a rigid body take up any moment; particles in one line have no friction.
void SurfaceContacts::make_friction_rows(TouchingPair& pair) {
  pair.has_friction_rows = true;
  std::optional<Turning> turning;
  const auto is_held = [](const TouchingParticle& p) { return !(p.inverse_mass > 0); };
  if (!pair.rigid && std::ranges::none_of(particles_of(pair), is_held)) {
    turning = turning_of(pair);
    if (!turning) return;
  }
  pair.axes.col(1) = pair.axes.col(0).unitOrthogonal();
  pair.axes.col(2) = pair.axes.col(0).cross(pair.axes.col(1));
  make_row(pair, 1, turning);
  make_row(pair, 2, turning);
  Eigen::Matrix2<Real> mobility;
  mobility << mobility_of(pair, 1, 1), mobility_of(pair, 1, 2), mobility_of(pair, 1, 2), mobility_of(pair, 2, 2);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2<Real>> directions;
  directions.computeDirect(mobility);
  for (int k = 0; k < 2; ++k)
    if (const Real along = directions.eigenvalues()[k]; along > least_mobility * pair.mobility)
      pair.inertia += directions.eigenvectors().col(k) * directions.eigenvectors().col(k).transpose() / along;
}

Real SurfaceContacts::mobility_of(const TouchingPair& pair, int row, int other) const {
  Real sum = pair.rigid ? pair.axes.col(row).dot(pair.rigid->mobility_at(pair.arm) * pair.axes.col(other)) : 0;
  for (const TouchingParticle& p : particles_of(pair)) sum += p.inverse_mass * p.rows.col(row).dot(p.rows.col(other));
  return sum;
}

Real SurfaceContacts::speed_of(const TouchingPair& pair, int row) const {
  Real sum = pair.rigid ? pair.rigid_weight * pair.axes.col(row).dot(pair.rigid->velocity_at(pair.arm)) : 0;
  for (const TouchingParticle& p : particles_of(pair)) sum += p.rows.col(row).dot(vector(p.velocity));
  return sum;
}

Eigen::Vector2<Real> SurfaceContacts::slip_of(const TouchingPair& pair) const {
  return {speed_of(pair, 1), speed_of(pair, 2)};
}

// share(p) is what particle p gets of the impulse. Whoever drives what is held does the work of what it gives.
template <class Share>
void SurfaceContacts::push(const TouchingPair& pair, const Vector3& impulse, const Share& share) {
  for (const TouchingParticle& p : particles_of(pair)) {
    const Vector3 given = share(p);
    if (p.inverse_mass > 0)
      vector(p.velocity) += p.inverse_mass * given;
    else
      outside_work_ -= given.dot(vector(p.velocity));
  }
  if (!pair.rigid) return;
  const Vector3 given = pair.rigid_weight * impulse;
  if (pair.rigid->is_dynamic())
    pair.rigid->push(given, pair.arm);
  else
    outside_work_ -= given.dot(pair.rigid->velocity_at(pair.arm));
}

void SurfaceContacts::book_loss(const TouchingPair& pair, Real loss) {
  island_.bodies[pair.body_a]->step_flows.contact_loss += loss / 2;
  island_.bodies[pair.body_b]->step_flows.contact_loss += loss / 2;
}

// From where it is, at `speed`, to an impulse of `given`.
void SurfaceContacts::press(TouchingPair& pair, Real given, Real speed) {
  const Real impulse = given - pair.given, reached = speed + impulse * pair.mobility;
  pair.given = given;
  push(pair, impulse * pair.axes.col(0),
       [impulse](const TouchingParticle& p) { return Vector3(impulse * p.rows.col(0)); });
  book_loss(pair, -impulse * (speed + reached) / 2);
}

// Lost thickness that comes back does work, as a surface that moves so fast.
void SurfaceContacts::book() {
  for (TouchingPair& pair : scratch_.pairs) {
    if (pair.given == 0) continue;
    record(pair);
    if (pair.gap > 0) continue;
    const Real work = pair.given * std::max<Real>(speed_of(pair, 0), 0);
    outside_work_ += work;
    book_loss(pair, work);
  }
}

// With what they gave before: the share of it that is best for all.
void SurfaceContacts::start(Real since) {
  const auto rate = [this](const TouchingPair& pair) {
    return pair.given * (speed_of(pair, 0) - pair.wanted) +
           (pair.rubbed.isZero(0) ? 0 : pair.rubbed.dot(slip_of(pair)));
  };
  Real before = 0, after = 0;
  for (TouchingPair& pair : scratch_.pairs)
    if (recall(pair, since)) before += rate(pair);
  if (!(before < 0)) {
    for (TouchingPair& pair : scratch_.pairs) forget(pair);
    return;
  }
  for (TouchingPair& pair : scratch_.pairs)
    if (pair.given > 0) {
      const Real given = std::exchange(pair.given, 0);
      const Eigen::Vector2<Real> rubbed = std::exchange(pair.rubbed, Eigen::Vector2<Real>(0, 0));
      press(pair, given, speed_of(pair, 0));
      if (!rubbed.isZero(0)) rub(pair, rubbed, slip_of(pair));
    }
  for (const TouchingPair& pair : scratch_.pairs)
    if (pair.given > 0) after += rate(pair);
  const Real share = best_share(before, after);
  if (share == 1) return;
  for (TouchingPair& pair : scratch_.pairs)
    if (pair.given > 0) {
      const Eigen::Vector2<Real> rubbed = share * pair.rubbed;
      press(pair, share * pair.given, speed_of(pair, 0));
      if (!rubbed.isZero(0)) rub(pair, rubbed, slip_of(pair));
    }
}

// Returns whether there is anything.
bool SurfaceContacts::recall(TouchingPair& pair, Real since) {
  if (!pair.memory || pair.memory->is_empty()) return false;
  const Vector3 impulse = pair.memory->start(since);
  pair.given = std::max<Real>(pair.axes.col(0).dot(impulse), 0);
  if (!(pair.given > 0) || !(pair.friction > 0)) return pair.given > 0;
  if (!pair.has_friction_rows) make_friction_rows(pair);
  if (!pair.inertia.isZero(0)) pair.rubbed = in_cone(pair, pair.axes.rightCols<2>().transpose() * impulse);
  return true;
}

// The impulse that stops the slip.
void SurfaceContacts::rub(TouchingPair& pair) {
  if (!pair.has_friction_rows) make_friction_rows(pair);
  if (pair.inertia.isZero(0)) return;
  const Eigen::Vector2<Real> slip = slip_of(pair);
  rub(pair, pair.rubbed - pair.inertia * slip, slip);
}

// From where it is, to an impulse of `rubbed`, or from there back into the cone.
void SurfaceContacts::rub(TouchingPair& pair, Eigen::Vector2<Real> rubbed, const Eigen::Vector2<Real>& slip) {
  rubbed = in_cone(pair, rubbed);
  const Eigen::Vector2<Real> change = rubbed - pair.rubbed;
  if (change.isZero(0)) return;
  pair.rubbed = rubbed;
  push(pair, pair.axes.rightCols<2>() * change,
       [&](const TouchingParticle& p) { return Vector3(p.rows.rightCols<2>() * change); });
  book_loss(pair, -change.dot(slip + slip_of(pair)) / 2);
}

}  // namespace penalty
