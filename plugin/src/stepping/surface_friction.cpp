// Friction of surface contacts, which leaves angular momentum alone.
#include <Eigen/LU>

#include "surface_contacts.h"

namespace penalty {

// How a unit impulse along `direction`, given at two points that are not on a line along it, turns the particles of the
// pair [rad/s / (N s)]; zero where something is held, which takes up any moment, or nearly no moment is needed.
Vector3 SurfaceContacts::turn_of(TouchingPair& pair, const Vector3& direction) const {
  if (!pair.has_inertia) find_inertia(pair);
  return pair.can_turn ? Vector3(pair.inverse_inertia * pair.difference.cross(direction)) : Vector3(Vector3::Zero());
}

// Angular momentum of the particles about their centre, if it is asked for [kg m²/s].
Vector3 SurfaceContacts::spin_of(const TouchingPair& pair, const Vector3& turn) const {
  Vector3 spin = Vector3::Zero();
  if (turn.isZero(0)) return spin;
  for (std::size_t k = pair.begin; k < pair.end; ++k) {
    const TouchingParticle& p = scratch_.particles[k];
    spin += (vector(p.position) - pair.center).cross(Vector3(vector(p.velocity))) / p.inverse_mass;
  }
  return spin;
}

void SurfaceContacts::find_inertia(TouchingPair& pair) const {
  pair.has_inertia = true;
  const std::span<const TouchingParticle> particles(&scratch_.particles[pair.begin], pair.end - pair.begin);
  Real mass = 0;
  for (const TouchingParticle& p : particles) {
    pair.is_held = pair.is_held || !(p.inverse_mass > 0);
    if (pair.is_held) return;
    mass += 1 / p.inverse_mass;
    pair.center += vector(p.position) / p.inverse_mass;
  }
  pair.center /= mass;
  Matrix3 inertia = Matrix3::Zero();
  for (const TouchingParticle& p : particles) {
    const Vector3 arm = vector(p.position) - pair.center;
    inertia += (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose()) / p.inverse_mass;
  }
  constexpr Real singular = 1e-9;
  const Real trace = inertia.trace();
  pair.can_turn = inertia.determinant() > singular * trace * trace * trace;
  if (pair.can_turn) pair.inverse_inertia = inertia.inverse();
}

// A pinned particle and a rigid body take up any moment; particles in one line have none about it to speak of, and no
// friction.
void SurfaceContacts::rub(TouchingPair& pair, Vector3 slip) {
  Vector3 turn = Vector3::Zero();
  if (!pair.rigid) {
    if (!pair.has_inertia) find_inertia(pair);
    if (pair.can_turn) {
      const Vector3 spin = spin_of(pair, pair.normal);
      slip -= (pair.inverse_inertia * spin).cross(pair.difference);
      slip -= pair.normal.dot(slip) * pair.normal;
    } else if (!pair.is_held) {
      return;
    }
  }
  // The impulse that stops the slip, and from there back into the cone.
  const auto mobility_along = [&](const Vector3& direction) {
    if (pair.rigid) return pair.soft_mobility + pair.rigid->mobility_at(pair.arm, direction);
    turn = turn_of(pair, direction);
    return pair.soft_mobility - pair.difference.cross(direction).dot(turn);
  };
  constexpr Real no_slip = 1e-12;
  Vector3 rubbed = pair.rubbed;
  if (const Real slip_speed = slip.norm(); slip_speed > no_slip) {
    const Real mobility = mobility_along(slip / slip_speed);
    if (!(mobility > least_mobility * pair.mobility)) return;
    rubbed -= slip / mobility;
  }
  const Real size = rubbed.norm(), most = pair.friction * pair.given;
  if (size > most) rubbed *= most / size;
  const Vector3 change = rubbed - pair.rubbed;
  const Real impulse = change.norm();
  if (impulse == 0) return;
  const Vector3 direction = change / impulse;
  const Real mobility = mobility_along(direction);
  if (!(mobility > least_mobility * pair.mobility)) return;
  pair.rubbed = rubbed;
  push(pair, impulse, direction, turn);
  const Real loss = -impulse * (direction.dot(slip) + impulse * mobility / 2);
  island_.bodies[pair.body_a]->step_flows.contact_loss += loss / 2;
  island_.bodies[pair.body_b]->step_flows.contact_loss += loss / 2;
}

}  // namespace penalty
