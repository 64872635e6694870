#include "backward_euler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <utility>

#include "implicit_contacts.h"
#include "implicit_surfaces.h"
#include "rigid_state.h"
#include "stepped_body.h"

namespace penalty {
namespace {

// So that all of several bodies have no more than about this many; bodies that come and go change it seldom.
constexpr int most_groups_of_all = 64;

int most_groups_of_each(std::size_t bodies) {
  return std::min<int>(BodyMatrix::most_groups,
                       static_cast<int>(std::bit_floor(std::max<std::size_t>(most_groups_of_all / bodies, 1))));
}

}  // namespace

BackwardEuler::BackwardEuler(Island& island, ImplicitSurfaces& surfaces, Real duration)
    : island_(island),
      state_(island.bodies.front()->implicit),
      newton_(state_.solver),
      all_surfaces_(surfaces),
      surfaces_(surfaces.are_near ? &surfaces : nullptr),
      duration_(duration),
      enough_(state_.enough) {
  if (!state_.contact_scratch) state_.contact_scratch = std::make_shared<ImplicitContactScratch>();
  Eigen::Index column = 0;
  newton_.tries_exact = true;
  newton_.linear = {.max_iterations = 0, .tolerance = 1};
  newton_.objective.bodies.clear();
  is_second_order_ = true;
  for (SteppedBody* body : island.bodies) {
    body->implicit.first = column;
    column += body->particles.size();
    prepare(*body);
    newton_.objective.bodies.push_back(&body->implicit.newton);
    const StepOptions& options = body->options;
    newton_.linear.max_iterations = std::max(newton_.linear.max_iterations, options.linear.max_iterations);
    newton_.linear.tolerance = std::min(newton_.linear.tolerance, options.linear.tolerance);
    most_iterations_ = std::max(most_iterations_, options.newton_iterations);
    gravity_ = std::max(gravity_, body->gravity.norm());
    is_second_order_ = is_second_order_ && options.implicit_order == 2;
  }
  for (PackedVectors* all : {&state_.from, &state_.base, &state_.carried, &state_.velocities}) all->resize(4, column);
}

void BackwardEuler::prepare(SteppedBody& body) {
  NewtonBody& newton = body.implicit.newton;
  if (!newton.has_pattern_of(*body.field)) newton.set_pattern(*body.field);
  newton.limit_groups(most_groups_of_each(island_.bodies.size()));
  const std::vector<Real>& inverse_masses = body.particles.inverse_masses;
  newton.clear_fixed();
  for (std::size_t i = 0; i < inverse_masses.size(); ++i)
    if (inverse_masses[i] == 0) newton.fix(static_cast<int>(i));
  newton.damping_time = body.options.damping_time;
}

void BackwardEuler::set_inertia_time(Real duration) {
  inertia_time_ = duration;
  newton_.objective.inverse_duration = 1 / duration;
  for (SteppedBody* body : island_.bodies) {
    const std::vector<Real>& inverse_masses = body->particles.inverse_masses;
    std::vector<Real>& weights = body->implicit.newton.weights;
    weights.resize(inverse_masses.size());
    for (std::size_t i = 0; i < inverse_masses.size(); ++i)
      weights[i] = inverse_or_zero(inverse_masses[i]) / (duration * duration);
  }
}

void BackwardEuler::aim() {
  aim_rigid_bodies();
  for (SteppedBody* body : island_.bodies) aim(*body);
}

// Where the particles would be without elastic forces; pinned ones go where their velocity takes them.
void BackwardEuler::aim(SteppedBody& body) {
  const auto base = columns_of(body, state_.base);
  auto targets = columns_of(body, newton_.objective.targets);
  targets = base + inertia_time_ * columns_of(body, state_.carried);
  for (int i = 0; i < body.particles.size(); ++i) {
    const Real inverse_mass = body.particles.inverse_masses[i];
    if (!(inverse_mass > 0)) continue;
    Vector3 acceleration = body.gravity;
    if (body.external_forces.size() != 0) acceleration += inverse_mass * body.external_forces.col(i).head<3>();
    targets.col(i).head<3>() += inertia_time_ * inertia_time_ * acceleration;
  }
  if (body.options.damping_time > 0 || body.field->damps())
    body.implicit.newton.damped_from = base;
  else
    body.implicit.newton.damped_from.resize(4, 0);
}

void BackwardEuler::aim_rigid_bodies() {
  Objective& objective = newton_.objective;
  const Real rate2 = 1 / (duration_ * duration_);
  objective.rigid_bodies.clear();
  for (const RigidBody& rigid : island_.rigid_bodies)
    if (rigid.is_dynamic())
      objective.rigid_bodies.push_back(
          {.translation = rate2 * rigid.inverse_mass.cwiseInverse().asDiagonal().toDenseMatrix(),
           .rotation = rate2 * rigid.inverse_inertia.inverse()});
  Eigen::Index column = state_.from.cols();
  objective.targets.resize(4, column + 2 * static_cast<Eigen::Index>(objective.rigid_bodies.size()));
  for (const RigidBody& rigid : island_.rigid_bodies)
    if (rigid.is_dynamic()) {
      objective.targets.col(column++) << duration_ * (rigid.velocity + duration_ * rigid.acceleration), 0;
      objective.targets.col(column++) << duration_ * (rigid.angular_velocity + duration_ * rigid.angular_acceleration),
          0;
    }
}

// Particles where they are, and rigid bodies as they move, or where they are.
const PackedVectors& BackwardEuler::guess(bool rigid_bodies_move) {
  state_.guess.setZero(4, newton_.objective.targets.cols());
  Eigen::Index column = state_.from.cols();
  state_.guess.leftCols(column) = state_.from;
  if (rigid_bodies_move)
    for (const RigidBody& rigid : island_.rigid_bodies)
      if (rigid.is_dynamic()) {
        state_.guess.col(column++) << duration_ * rigid.velocity, 0;
        state_.guess.col(column++) << duration_ * rigid.angular_velocity, 0;
      }
  return state_.guess;
}

// The best of four guesses: free flight, rest, the acceleration of the last step once more, and rigid motion. In contact
// the second and third will do, as what flies up to an obstacle goes on as it did.
void BackwardEuler::choose_start() {
  const PackedVectors& targets = newton_.objective.targets;
  const bool may_go_on =
      std::ranges::any_of(island_.bodies, [](const SteppedBody* body) { return body->implicit.has_acceleration; });
  const bool flies = !touches_ || !may_go_on;
  if (flies) newton_.start(targets);
  if (may_go_on) {
    guess(true);
    for (const SteppedBody* body : island_.bodies) {
      auto columns = columns_of(*body, state_.guess);
      if (body->implicit.has_acceleration)
        columns += duration_ * body->particles.velocities + duration_ * duration_ * body->implicit.acceleration;
      else
        columns = columns_of(*body, targets);
    }
    flies ? newton_.offer(state_.guess) : newton_.start(state_.guess);
  }
  guess(false);
  for (const SteppedBody* body : island_.bodies)
    for (const int i : body->implicit.newton.fixed())
      state_.guess.col(body->implicit.first + i) = targets.col(body->implicit.first + i);
  newton_.offer(state_.guess);
  if (touches_) return;
  for (const SteppedBody* body : island_.bodies) columns_of(*body, state_.velocities) = body->particles.velocities;
  offer_rigid_motion(duration_, state_.from, state_.velocities);
}

// Of all bodies that turn, the others as they were chosen.
void BackwardEuler::offer_rigid_motion(Real interval, const PackedVectors& positions, const PackedVectors& velocities) {
  state_.guess = newton_.positions();
  bool does_any_turn = false;
  for (const SteppedBody* body : island_.bodies) {
    if (!is_free(*body)) continue;
    const auto from = columns_of(*body, positions);
    const RigidState rigid(from, columns_of(*body, velocities), body->particles.inverse_masses);
    const Vector3 turn = interval * rigid.angular_velocity(rigid.spin);
    const Real angle = turn.norm();
    if (!(angle > 0)) continue;
    does_any_turn = true;
    const Matrix3 rotation = Eigen::AngleAxis<Real>(angle, turn / angle).toRotationMatrix();
    const Vector3 center = rigid.center + interval * rigid.momentum / rigid.mass + interval * interval * body->gravity;
    auto columns = columns_of(*body, state_.guess);
    for (int i = 0; i < body->particles.size(); ++i)
      columns.col(i).head<3>() = rotation * (from.col(i).head<3>() - rigid.center) + center;
  }
  if (does_any_turn) newton_.offer(state_.guess);
}

// Turned at a constant speed, a body whose moments of inertia differ does not keep its energy.
void BackwardEuler::drift_rigid_bodies() {
  for (RigidBody& rigid : island_.rigid_bodies) {
    outside_work_ -= kinetic_energy(rigid);
    rigid.drift(duration_);
    outside_work_ += kinetic_energy(rigid);
  }
}

void BackwardEuler::take_at_once(ImplicitContacts& contacts) {
  set_inertia_time(duration_);
  for (SteppedBody* body : island_.bodies) {
    columns_of(*body, state_.base) = body->particles.positions;
    columns_of(*body, state_.carried) = body->particles.velocities;
    body->implicit.first_stage = {};
  }
  aim();
  newton_.prepare();
  if (touches_) {
    begin_in_contact(contacts);
    minimize_in_contact(contacts);
  } else {
    choose_start();
    minimize();
  }
}

bool BackwardEuler::run() {
  for (const SteppedBody* body : island_.bodies) columns_of(*body, state_.from) = body->particles.positions;
  ImplicitContacts contacts(island_, state_.from, surfaces_, duration_);
  touches_ = !contacts.is_empty();
  in_stages_ = is_second_order_ && !touches_ && !surfaces_;
  newton_.objective.contacts = touches_ ? &contacts : nullptr;
  in_stages_ ? take_stages() : take_at_once(contacts);
  newton_.objective.contacts = nullptr;
  if (!surfaces_ && !island_.surfaces.empty() && std::isfinite(newton_.value()) &&
      all_surfaces_.meet(newton_.positions() - guess(false))) {
    if (!all_surfaces_.may_be_near) return false;
    all_surfaces_.are_near = true;
    surfaces_ = &all_surfaces_;
    return run();
  }
  for (RigidBody& rigid : island_.rigid_bodies) rigid.kick(duration_);
  contacts.finish(newton_.positions());
  outside_work_ += contacts.outside_work();
  for (std::size_t k = 0; k < island_.bodies.size(); ++k) end(k, contacts);
  drift_rigid_bodies();
  if (surfaces_) return surfaces_->end();
  if (!island_.surfaces.empty()) all_surfaces_.pass(state_.from);
  return true;
}

void BackwardEuler::end(std::size_t k, const ImplicitContacts& contacts) {
  SteppedBody& body = *island_.bodies[k];
  Particles& particles = body.particles;
  ImplicitState& state = body.implicit;
  body.step_flows.contacts += contacts.given_to(k).work;
  body.step_flows.contact_loss += contacts.given_to(k).loss;
  const auto end = columns_of(body, newton_.positions());
  const auto from = columns_of(body, std::as_const(state_.from)), base = columns_of(body, std::as_const(state_.base));
  const RigidState before = is_free(body) ? RigidState(particles) : RigidState();
  state.acceleration = ((end - from) / duration_ - particles.velocities) / duration_;
  state.has_acceleration = true;
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] > 0) particles.velocities.col(i) = (end.col(i) - base.col(i)) / inertia_time_;
  particles.positions = end;
  if (is_free(body)) restore_momenta(k, before, contacts);

  body.elastic_energy = newton_.elastic_energy(k);
  body.forces = columns_of(body, newton_.forces());
  for (const int i : state.newton.fixed())
    body.step_flows.driving -= inertia_time_ * body.forces.col(i).dot(particles.velocities.col(i));
  if (body.external_forces.size() != 0) body.forces += body.external_forces;
  body.step_flows.driving += state.first_stage.driving;
  body.step_flows.damping += state.first_stage.damping + newton_.damping_work(k);
  if (body.field->evolves()) {
    const Real taken = body.field->evolve(particles.positions, duration_);
    body.step_flows.inelastic += taken;
    if (taken != 0) {
      evaluate_forces(body);
      state.newton.forget_stiffness();
    }
  }
}

}  // namespace penalty
