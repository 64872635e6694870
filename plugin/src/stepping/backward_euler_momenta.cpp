// The part of BackwardEuler that sets momenta and energy right.
#include <algorithm>
#include <cmath>
#include <utility>

#include "backward_euler.h"
#include "implicit_contacts.h"
#include "rigid_state.h"

namespace penalty {
namespace {

constexpr Real sum_round_off = 1e-12;  // of a sum of forces, relative to the sum of their magnitudes

}  // namespace

FromOutside::FromOutside(const Positions& forces, const Positions& positions, const Vector3& center)
    : force(Vector3::Zero()), torque(Vector3::Zero()) {
  Real magnitude = 0, torques = 0;
  for (Eigen::Index i = 0; i < forces.cols(); ++i) {
    const Vector3 f = forces.col(i).head<3>(), arm = positions.col(i).head<3>() - center;
    force += f;
    torque += arm.cross(f);
    magnitude += f.norm();
    torques += arm.norm() * f.norm();
  }
  if (force.norm() < sum_round_off * magnitude) force.setZero();
  if (torque.norm() < sum_round_off * torques) torque.setZero();
}

// What the minimum, and iterations that end before it, take from the momenta of a free body.
void BackwardEuler::restore_momenta(std::size_t k, const RigidState& before, const ImplicitContacts& contacts) {
  SteppedBody& body = *island_.bodies[k];
  Particles& particles = body.particles;
  const RigidState now(particles);
  const auto positions = columns_of(body, newton_.positions());
  const Vector3 center = in_stages_ ? now.center : before.center;
  const FromOutside outside(columns_of(body, newton_.forces()), positions, center);
  const FirstStage& first = body.implicit.first_stage;
  const GivenInStep& given = contacts.given_to(k);
  Vector3 momentum = before.momentum + duration_ * before.mass * body.gravity + inertia_time_ * outside.force +
                     first.impulse + given.impulse;
  Vector3 spin = before.spin + inertia_time_ * outside.torque + first.moment + given.moment_about(before.center);
  if (body.external_forces.size() != 0) {
    const auto from = columns_of(body, std::as_const(in_stages_ ? newton_.positions() : state_.from));
    for (int i = 0; i < particles.size(); ++i) {
      const Vector3 impulse = inertia_time_ * body.external_forces.col(i).head<3>();
      momentum += impulse;
      spin += (from.col(i).head<3>() - center).cross(impulse);
    }
  }
  if (contacts.touch_immovable())
    spin = now.spin;  // is no longer its own: given back on a way that obstacles bend, it would gain energy
  else if (touches_)
    spin -= (now.center - before.center).cross(momentum);
  const Vector3 dv = (momentum - now.momentum) / now.mass, dw = now.angular_velocity(spin - now.spin);
  body.report.restored_momentum = (momentum - now.momentum).norm();
  body.report.restored_spin = (spin - now.spin).norm();
  for (int i = 0; i < particles.size(); ++i) {
    const Vector3 arm = particles.positions.col(i).head<3>() - now.center;
    particles.velocities.col(i).head<3>() += dv + dw.cross(arm);
    if (!touches_) particles.positions.col(i).head<3>() += inertia_time_ * dv;
  }
}

void BackwardEuler::cap_energy(Real allowed) {
  Real excess = -allowed;
  for (SteppedBody* body : island_.bodies) {
    body->report.capped_energy = 0;
    excess += body->elastic_energy + kinetic_energy(body->particles);
  }
  if (!(excess > 0)) return;
  Real at_hand = 0;  // what may be taken
  for (const SteppedBody* body : island_.bodies)
    at_hand += kinetic_energy(body->particles) - (is_free(*body) ? RigidState(body->particles).kinetic_energy() : 0);
  if (!(at_hand > 0)) return;
  const Real share = std::sqrt(std::max<Real>(0, 1 - excess / at_hand));
  for (SteppedBody* body : island_.bodies) {
    Particles& particles = body->particles;
    const Real before = kinetic_energy(particles);
    const RigidState rigid = is_free(*body) ? RigidState(particles) : RigidState();
    const Vector3 velocity = is_free(*body) ? Vector3(rigid.momentum / rigid.mass) : Vector3::Zero(),
                  turn = is_free(*body) ? rigid.angular_velocity(rigid.spin) : Vector3::Zero();
    for (int i = 0; i < particles.size(); ++i) {
      if (!(particles.inverse_masses[i] > 0)) continue;
      const Vector3 as_rigid = velocity + turn.cross(Vector3(particles.positions.col(i).head<3>() - rigid.center));
      auto v = particles.velocities.col(i).head<3>();
      v = as_rigid + share * (v - as_rigid);
    }
    body->report.capped_energy = before - kinetic_energy(particles);
  }
}

}  // namespace penalty
