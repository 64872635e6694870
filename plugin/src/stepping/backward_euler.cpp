#include "backward_euler.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "implicit_contacts.h"
#include "implicit_surfaces.h"
#include "rigid_state.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr Real sum_round_off = 1e-12;  // of a sum of forces, relative to the sum of their magnitudes
constexpr Real least_energy = 1e-300;  // [J]
constexpr Real round_off2 = 1e-28;     // square of that of positions, relative to the size of the body

// In contact:
constexpr Real friction_change = 0.01;                       // of the limits of friction, of their sum, that is left
constexpr int fewest_between_updates = 4, most_updates = 6;  // iterations, and of the limits
constexpr int times_iterations = 3;                          // as many as without contact, at most
constexpr Real kept_stiffness = 0.005;  // motion that leaves the stiffness as it is, by the distance of particles
constexpr int oldest_stiffness = 4;     // iterations that it is kept
constexpr Real slow_fall = 0.25;        // of the residual in an iteration: then the stiffness is assembled anew,
constexpr Real still_slow = 2;          // unless it fell hardly faster when it was new
constexpr Real settled_gap = 1e-4;      // of what presses [m/s]
constexpr Real sudden = 5;              // approach [speeds gained by gravity in a step] that is an impact

}  // namespace

BackwardEuler::BackwardEuler(Island& island, ImplicitSurfaces* surfaces, Real duration)
    : island_(island),
      body_(*island.bodies.front()),
      particles_(body_.particles),
      state_(body_.implicit),
      newton_(state_.newton),
      surfaces_(surfaces),
      duration_(duration) {
  if (!newton_.has_pattern_of(*body_.field)) newton_.set_pattern(*body_.field);
  newton_.clear_fixed();
  for (int i = 0; i < particles_.size(); ++i)
    if (particles_.inverse_masses[i] == 0) newton_.fix(i);
  newton_.linear = body_.options.linear;
  Objective& objective = newton_.objective;
  objective.field = body_.field;
  objective.weights.resize(particles_.inverse_masses.size());
  for (std::size_t i = 0; i < objective.weights.size(); ++i)
    objective.weights[i] = inverse_or_zero(particles_.inverse_masses[i]) / (duration * duration);
  objective.damping_time = body_.options.damping_time;
  objective.inverse_duration = 1 / duration;
}

// Where the particles would be without elastic forces; pinned ones go where their velocity takes them.
void BackwardEuler::aim() {
  Objective& objective = newton_.objective;
  aim_rigid_bodies();
  objective.targets.leftCols(particles_.size()) = state_.from + duration_ * particles_.velocities;
  for (int i = 0; i < particles_.size(); ++i) {
    const Real inverse_mass = particles_.inverse_masses[i];
    if (!(inverse_mass > 0)) continue;
    Vector3 acceleration = body_.gravity;
    if (body_.external_forces.size() != 0) acceleration += inverse_mass * body_.external_forces.col(i).head<3>();
    objective.targets.col(i).head<3>() += duration_ * duration_ * acceleration;
  }
  if (body_.options.damping_time > 0 || body_.field->damps())
    objective.damped_from = state_.from;
  else
    objective.damped_from.resize(4, 0);
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
  Eigen::Index column = particles_.size();
  objective.targets.resize(4, column + 2 * static_cast<Eigen::Index>(objective.rigid_bodies.size()));
  for (const RigidBody& rigid : island_.rigid_bodies)
    if (rigid.is_dynamic()) {
      objective.targets.col(column++) << duration_ * (rigid.velocity + duration_ * rigid.acceleration), 0;
      objective.targets.col(column++) << duration_ * (rigid.angular_velocity + duration_ * rigid.angular_acceleration),
          0;
    }
}

// With rigid bodies as they move, or where they are.
template <class Derived>
const PackedVectors& BackwardEuler::guess(const Eigen::MatrixBase<Derived>& positions, bool rigid_bodies_move) {
  state_.guess.setZero(4, newton_.objective.targets.cols());
  Eigen::Index column = particles_.size();
  state_.guess.leftCols(column) = positions;
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
  const Objective& objective = newton_.objective;
  newton_.prepare();
  const bool flies = !touches_ || !state_.has_acceleration;
  if (flies) newton_.start(objective.targets);
  if (state_.has_acceleration) {
    guess(state_.from + duration_ * particles_.velocities + duration_ * duration_ * state_.acceleration, true);
    flies ? newton_.offer(state_.guess) : newton_.start(state_.guess);
  }
  guess(state_.from, false);
  for (const int i : newton_.fixed()) state_.guess.col(i) = objective.targets.col(i);
  newton_.offer(state_.guess);
  if (touches_ || !is_free()) return;
  const RigidState rigid(particles_);
  const Vector3 turn = duration_ * rigid.angular_velocity(rigid.spin);
  const Real angle = turn.norm();
  if (!(angle > 0)) return;
  const Matrix3 rotation = Eigen::AngleAxis<Real>(angle, turn / angle).toRotationMatrix();
  const Vector3 center = rigid.center + duration_ * rigid.momentum / rigid.mass + duration_ * duration_ * body_.gravity;
  guess(state_.from, true);
  for (int i = 0; i < particles_.size(); ++i)
    state_.guess.col(i).head<3>() = rotation * (state_.from.col(i).head<3>() - rigid.center) + center;
  newton_.offer(state_.guess);
}

Real BackwardEuler::stiffness_range() const {
  return kept_stiffness * body_.size / std::cbrt(static_cast<Real>(particles_.size()));
}

// What is left of forces where nothing is, by round-off.
Real BackwardEuler::noise() const {
  const Real stiffness = 1 / (duration_ * duration_) + body_.largest_eigenvalue;  // of inertia and elements, per mass
  return round_off2 * body_.mass * stiffness * body_.rest_span.spreads.squaredNorm();
}

void BackwardEuler::minimize() {
  const Real tolerance2 = body_.options.newton_tolerance * body_.options.newton_tolerance;
  Real enough = 0;
  for (int k = 0; k < body_.options.newton_iterations; ++k) {
    const NewtonIteration iteration = newton_.iterate();
    ++body_.report.newton_iterations;
    body_.report.linear_iterations += iteration.linear_iterations;
    if (k == 0) enough = std::max(tolerance2 * iteration.before, noise());
    if (iteration.length == 0 || iteration.after <= enough) break;
  }
}

// By the energy of each body as it would move without forces, or, if that is more, its share by mass of that of all: what is
// light does not hide behind what is heavy, nor make it wait.
void BackwardEuler::find_enough() {
  const Objective& objective = newton_.objective;
  std::vector<Real> masses{body_.mass}, twice{0};
  for (int i = 0; i < particles_.size(); ++i)
    twice[0] += objective.weights[i] * (objective.targets.col(i) - state_.from.col(i)).squaredNorm();
  for (Eigen::Index column = particles_.size(); const RigidInertia& inertia : objective.rigid_bodies) {
    twice.push_back(0);
    for (const Matrix3* block : {&inertia.translation, &inertia.rotation}) {
      const Vector3 way = objective.targets.col(column++).head<3>();
      twice.back() += way.dot(*block * way);
    }
    masses.push_back(duration_ * duration_ * inertia.translation(0, 0));
  }
  const Real mass = std::accumulate(masses.begin(), masses.end(), Real(0));
  const Real all = std::accumulate(twice.begin(), twice.end(), Real(0));
  const Real tolerance2 = body_.options.newton_tolerance * body_.options.newton_tolerance;
  enough_.clear();
  for (std::size_t k = 0; k < masses.size(); ++k) {
    const Real share = mass > 0 ? masses[k] / mass * all : 0;
    enough_.push_back(std::max({tolerance2 * std::max(twice[k], share) / 2, noise(), least_energy}));
  }
}

// The largest of a body, by what is enough.
Real BackwardEuler::residual() {
  newton_.squared_residual();
  Real largest = 0;
  Eigen::Index first = 0, count = particles_.size();
  for (const Real enough : enough_) {
    largest = std::max(largest, std::abs(newton_.residual_share(first, count)) / enough);
    first += count;
    count = 2;
  }
  return largest;
}

void BackwardEuler::take_surfaces(ImplicitContacts& contacts) {
  if (surfaces_) {
    contacts.take_surfaces(newton_.positions());
    contacts.set_hardness(newton_);
  }
  newton_.evaluate_again();
}

// Where surfaces may touch, what is begun with must be within reach.
void BackwardEuler::begin_in_contact(ImplicitContacts& contacts) {
  const Objective& objective = newton_.objective;
  if (!newton_.has_stiffness()) {
    newton_.objective.contacts = nullptr;
    newton_.prepare();
    newton_.start(guess(state_.from, false));
    newton_.linearize();
    newton_.objective.contacts = &contacts;
  }
  if (surfaces_) {
    surfaces_->begin(objective.targets.cols());
    surfaces_->aim(objective.targets - guess(state_.from, false));
    contacts.take_surfaces(guess(state_.from, false));
  }
  contacts.set_hardness(newton_);
  choose_start();
  if (surfaces_) {
    const PackedVectors start = newton_.positions(), from = guess(state_.from, false);
    if (surfaces_->aim(start - from) < 1)
      newton_.start(from);
    else
      surfaces_->move(1, start);
    take_surfaces(contacts);
  }
  contacts.predict(objective.targets, sudden * duration_ * body_.gravity.norm());
}

// By iterations that hold the limits of friction, and updates of these in between.
void BackwardEuler::minimize_in_contact(ImplicitContacts& contacts) {
  find_enough();
  const int most = times_iterations * body_.options.newton_iterations;
  int since_update = 0, updates = 0, age = 0;
  Real fresh_fall = 0;
  bool is_fresh = true;  // linearised here
  newton_.linearize(newton_.may_keep_stiffness(newton_.positions(), stiffness_range()));
  Real left = residual(), before = left;
  for (int k = 0;;) {
    const bool is_balanced = left <= 1;
    if (k > 0 && (is_balanced || since_update >= fewest_between_updates)) {
      const ImplicitContacts::Change change = contacts.limit_change(newton_.positions());
      const bool is_settled = change.limits <= friction_change * change.sum && change.gap < settled_gap * duration_ &&
                              contacts.fit(newton_.positions());
      if ((is_settled && is_balanced) || (updates >= most_updates && is_balanced) || k >= most) break;
      ++updates;
      since_update = 0;
      contacts.update(newton_.positions(), is_balanced, settled_gap * duration_);
      take_surfaces(contacts);
      left = before = residual();
    }
    if (k >= most || !std::isfinite(left)) break;
    if (!is_fresh) {
      const Real fall = left / before;
      if (age == 0 && since_update > 0) fresh_fall = fall;
      const bool is_slow = since_update > 1 && fall > std::max(slow_fall, still_slow * fresh_fall);
      const bool keeps = !is_slow && age < oldest_stiffness;
      age = keeps ? age + 1 : 0;
      newton_.linearize(keeps);
    }
    is_fresh = false;
    const NewtonIteration iteration = newton_.descend();
    contacts.follow(iteration.length, newton_.direction(), newton_.positions());
    ++k;
    ++since_update;
    ++body_.report.newton_iterations;
    body_.report.linear_iterations += iteration.linear_iterations;
    if (iteration.length == 0) break;
    before = left;
    if (contacts.is_cut()) take_surfaces(contacts);
    left = residual();
  }
}

// What the minimum, and iterations that end before it, take from the momenta of a free body.
void BackwardEuler::restore_momenta(const RigidState& before, const ImplicitContacts& contacts) {
  // Of the potential: only what acts from outside leaves any.
  Vector3 force = Vector3::Zero(), torque = Vector3::Zero();
  Real forces = 0, torques = 0;
  for (int i = 0; i < particles_.size(); ++i) {
    const Vector3 f = newton_.forces().col(i).head<3>(), arm = newton_.positions().col(i).head<3>() - before.center;
    force += f;
    torque += arm.cross(f);
    forces += f.norm();
    torques += arm.norm() * f.norm();
  }
  if (force.norm() < sum_round_off * forces) force.setZero();
  if (torque.norm() < sum_round_off * torques) torque.setZero();
  Vector3 momentum = before.momentum + duration_ * (before.mass * body_.gravity + force) + contacts.impulse();
  Vector3 spin = before.spin + duration_ * torque + contacts.moment(before.center);
  if (body_.external_forces.size() != 0)
    for (int i = 0; i < particles_.size(); ++i) {
      const Vector3 impulse = duration_ * body_.external_forces.col(i).head<3>();
      momentum += impulse;
      spin += (state_.from.col(i).head<3>() - before.center).cross(impulse);
    }
  const RigidState now(particles_);
  if (contacts.touch_immovable())
    spin = now.spin;  // is no longer its own: given back on a way that obstacles bend, it would gain energy
  else if (touches_)
    spin -= (now.center - before.center).cross(momentum);
  const Vector3 dv = (momentum - now.momentum) / now.mass, dw = now.angular_velocity(spin - now.spin);
  body_.report.restored_momentum = (momentum - now.momentum).norm();
  body_.report.restored_spin = (spin - now.spin).norm();
  for (int i = 0; i < particles_.size(); ++i) {
    const Vector3 arm = particles_.positions.col(i).head<3>() - now.center;
    particles_.velocities.col(i).head<3>() += dv + dw.cross(arm);
    if (!touches_) particles_.positions.col(i).head<3>() += duration_ * dv;
  }
}

void BackwardEuler::cap_energy(Real allowed) {
  body_.report.capped_energy = 0;
  const Real kinetic = kinetic_energy(particles_), excess = body_.elastic_energy + kinetic - allowed;
  if (!(excess > 0)) return;
  if (is_free()) {
    const RigidState rigid(particles_);
    const Vector3 velocity = rigid.momentum / rigid.mass, turn = rigid.angular_velocity(rigid.spin);
    const Real of_rigid = velocity.dot(rigid.momentum) / 2 + turn.dot(rigid.spin) / 2;
    const Real of_deformation = kinetic - of_rigid;
    if (!(of_deformation > 0)) return;
    const Real share = std::sqrt(std::max<Real>(0, 1 - excess / of_deformation));
    for (int i = 0; i < particles_.size(); ++i) {
      const Vector3 as_rigid = velocity + turn.cross(Vector3(particles_.positions.col(i).head<3>() - rigid.center));
      auto v = particles_.velocities.col(i).head<3>();
      v = as_rigid + share * (v - as_rigid);
    }
  } else {
    const Real share = std::sqrt(std::max<Real>(0, 1 - excess / kinetic));
    for (int i = 0; i < particles_.size(); ++i)
      if (particles_.inverse_masses[i] > 0) particles_.velocities.col(i) *= share;
  }
  body_.report.capped_energy = kinetic - kinetic_energy(particles_);
}

// Turned at a constant speed, a body whose moments of inertia differ does not keep its energy.
void BackwardEuler::drift_rigid_bodies() {
  for (RigidBody& rigid : island_.rigid_bodies) {
    outside_work_ -= kinetic_energy(rigid);
    rigid.drift(duration_);
    outside_work_ += kinetic_energy(rigid);
  }
}

bool BackwardEuler::run() {
  state_.from = particles_.positions;
  ImplicitContacts contacts(island_, state_.contacts, surfaces_, duration_);
  touches_ = !contacts.is_empty();
  newton_.objective.contacts = touches_ ? &contacts : nullptr;
  aim();
  if (!touches_) {
    choose_start();
    minimize();
  } else {
    begin_in_contact(contacts);
    minimize_in_contact(contacts);
  }
  for (RigidBody& rigid : island_.rigid_bodies) rigid.kick(duration_);
  contacts.finish(newton_.positions(), state_.contacts);
  newton_.objective.contacts = nullptr;
  body_.step_flows.contacts += contacts.work();
  outside_work_ += contacts.outside_work();
  const auto end = newton_.positions().leftCols(particles_.size());
  const RigidState before = is_free() ? RigidState(particles_) : RigidState();
  state_.acceleration = ((end - state_.from) / duration_ - particles_.velocities) / duration_;
  state_.has_acceleration = true;
  for (int i = 0; i < particles_.size(); ++i)
    if (particles_.inverse_masses[i] > 0) particles_.velocities.col(i) = (end.col(i) - state_.from.col(i)) / duration_;
  particles_.positions = end;
  if (is_free()) restore_momenta(before, contacts);
  drift_rigid_bodies();

  body_.elastic_energy = newton_.elastic_energy();
  body_.forces = newton_.forces();
  for (const int i : newton_.fixed())
    body_.step_flows.driving -= duration_ * newton_.forces().col(i).dot(particles_.velocities.col(i));
  if (body_.external_forces.size() != 0) body_.forces += body_.external_forces;
  body_.step_flows.damping += newton_.damping_work();
  if (body_.field->evolves()) {
    const Real taken = body_.field->evolve(particles_.positions, duration_);
    body_.step_flows.inelastic += taken;
    if (taken != 0) {
      evaluate_forces(body_);
      newton_.forget_stiffness();
    }
  }
  return !surfaces_ || surfaces_->end();
}

}  // namespace penalty
