// The part of BackwardEuler that takes steps of second order, where nothing touches: TR-BDF2, the trapezoidal rule up to the
// share gamma = 2 - sqrt(2) of the step, then the second-order backward difference (Bank et al. 1985; Hosea and Shampine 1996,
// "Analysis and implementation of TR-BDF2"). Both are minima of the same kind as that of backward Euler: with t = gamma h / 2,
//
//     x1 = x0 + t (v0 + v1),             v1 = v0 + t (a0 + a1)
//     x2 = p x1 - q x0 + t v2,           v2 = p v1 - q v0 + t a2,      p = 1 / (gamma (2 - gamma)), q = p - 1
//
// so that what happens in the first counts p times in the end.
#include <numbers>

#include "backward_euler.h"
#include "rigid_state.h"

namespace penalty {
namespace {

constexpr Real first_share = 2 - std::numbers::sqrt2;
constexpr Real of_first = 1 / (first_share * (2 - first_share));  // p
constexpr Real of_start = of_first - 1;                           // q

}  // namespace

void BackwardEuler::take_stages() {
  set_inertia_time(first_share / 2 * duration_);
  for (PackedVectors* all : {&state_.stage, &state_.stage_velocities}) all->resize(4, state_.from.cols());
  take_trapezoid();
  take_difference();
}

// Damping acts at its end only, twice: what it takes is of first order.
void BackwardEuler::take_trapezoid() {
  const Real t = inertia_time_;
  newton_.objective.inverse_duration = 2 / t;
  aim_rigid_bodies();
  for (SteppedBody* body : island_.bodies) {
    const Particles& particles = body->particles;
    columns_of(*body, state_.velocities) = particles.velocities;
    columns_of(*body, state_.base) = particles.positions + t * particles.velocities;
    auto carried = columns_of(*body, state_.carried);
    carried = particles.velocities;
    for (int i = 0; i < particles.size(); ++i)
      if (particles.inverse_masses[i] > 0)
        carried.col(i).head<3>() += t * (particles.inverse_masses[i] * body->forces.col(i).head<3>() + body->gravity);
    aim(*body);
  }
  state_.guess = newton_.objective.targets;
  state_.guess.leftCols(state_.from.cols()) = state_.from + 2 * t * state_.carried;
  minimize_stage(2 * t, state_.from, state_.velocities);

  state_.stage = newton_.positions().leftCols(state_.from.cols());
  state_.stage_velocities = (state_.stage - state_.base) / t;
  for (std::size_t k = 0; k < island_.bodies.size(); ++k) {
    SteppedBody& body = *island_.bodies[k];
    const Particles& particles = body.particles;
    auto forces = columns_of(body, state_.guess);
    forces = columns_of(body, newton_.forces());
    if (body.external_forces.size() != 0) forces += body.external_forces;
    FirstStage& first = body.implicit.first_stage;
    first = {};
    first.damping = of_first * newton_.damping_work(k);
    for (const int i : body.implicit.newton.fixed()) {
      Vector3 sum = (body.forces.col(i) + forces.col(i)).head<3>();
      if (body.external_forces.size() != 0) sum -= 2 * body.external_forces.col(i).head<3>();
      first.driving -= of_first * t * sum.dot(particles.velocities.col(i).head<3>());
    }
    if (!is_free(body)) continue;
    auto end = columns_of(body, state_.stage), velocities = columns_of(body, state_.stage_velocities);
    const RigidState before(particles), now(end, velocities, particles.inverse_masses);
    const FromOutside at_start(body.forces, particles.positions, before.center), at_end(forces, end, now.center);
    const Vector3 impulse = t * (at_start.force + at_end.force);
    first.impulse = of_first * impulse;
    first.moment = of_first * t * (at_start.torque + at_end.torque);
    // As at the end of a step: what iterations that end before the minimum took from the momentum.
    const Vector3 dv = (before.momentum + impulse + 2 * t * now.mass * body.gravity - now.momentum) / now.mass;
    velocities.topRows<3>().colwise() += dv;
    end.topRows<3>().colwise() += t * dv;
  }
}

void BackwardEuler::take_difference() {
  const Real t = inertia_time_;
  newton_.objective.inverse_duration = 1 / t;
  aim_rigid_bodies();
  const auto columns = state_.from.cols();
  state_.guess.leftCols(columns) =
      state_.stage + std::numbers::sqrt2 * t * state_.stage_velocities + t * (state_.stage_velocities - state_.carried);
  state_.base = of_first * state_.stage - of_start * state_.from;
  state_.carried = of_first * state_.stage_velocities - of_start * state_.velocities;
  for (SteppedBody* body : island_.bodies) aim(*body);
  state_.guess.rightCols(state_.guess.cols() - columns) =
      newton_.objective.targets.rightCols(state_.guess.cols() - columns);
  minimize_stage(std::numbers::sqrt2 * t, state_.stage, state_.stage_velocities);
}

// The best of four guesses: without elastic forces, with those of the beginning (`guess`), rest, and rigid motion.
void BackwardEuler::minimize_stage(Real interval, const PackedVectors& positions, const PackedVectors& velocities) {
  newton_.prepare();
  const PackedVectors& targets = newton_.objective.targets;
  newton_.start(targets);
  newton_.offer(state_.guess);
  state_.guess.leftCols(positions.cols()) = positions;
  for (const SteppedBody* body : island_.bodies)
    for (const int i : body->implicit.newton.fixed())
      state_.guess.col(body->implicit.first + i) = targets.col(body->implicit.first + i);
  newton_.offer(state_.guess);
  offer_rigid_motion(interval, positions, velocities);
  minimize();
}

}  // namespace penalty
