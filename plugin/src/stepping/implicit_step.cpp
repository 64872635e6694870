#include "implicit_step.h"

#include <algorithm>
#include <cmath>

#include "energy_guard.h"
#include "rigid_state.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr int most_implicit_substeps = 16;  // of a step whose energy would grow
constexpr Real growth_noise = 1e-12;        // relative growth of energy that is round-off
constexpr Real sum_round_off = 1e-12;       // of a sum of forces, relative to the sum of their magnitudes
constexpr Real round_off2 = 1e-28;          // square of that of positions, relative to the size of the body

/// One backward Euler step of a body.
class ImplicitStep {
 public:
  ImplicitStep(SteppedBody& body, Real duration)
      : body_(body), particles_(body.particles), state_(body.implicit), newton_(state_.newton), duration_(duration) {
    if (!newton_.has_pattern_of(*body.field)) newton_.set_pattern(*body.field);
    newton_.clear_fixed();
    for (int i = 0; i < particles_.size(); ++i)
      if (particles_.inverse_masses[i] == 0) newton_.fix(i);
    newton_.linear = body.options.linear;
    Objective& objective = newton_.objective;
    objective.field = body.field;
    objective.weights.resize(particles_.inverse_masses.size());
    for (std::size_t i = 0; i < objective.weights.size(); ++i)
      objective.weights[i] = inverse_or_zero(particles_.inverse_masses[i]) / (duration * duration);
    objective.damping_time = body.options.damping_time;
    objective.inverse_duration = 1 / duration;
  }

  void run();

  /// Takes energy beyond `allowed` [J] from the velocities relative to the rigid motion; of a body with pinned
  /// particles from all velocities.
  void cap_energy(Real allowed);

 private:
  void aim();
  void choose_start();
  void minimize();
  void restore_momenta(const RigidState& before);
  bool is_free() const { return newton_.fixed().empty(); }

  SteppedBody& body_;
  Particles& particles_;
  ImplicitState& state_;
  NewtonSolver& newton_;
  Real duration_;
};

// Where the particles would be without elastic forces; pinned ones go where their velocity takes them.
void ImplicitStep::aim() {
  Objective& objective = newton_.objective;
  objective.targets = state_.from + duration_ * particles_.velocities;
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

// The best of four guesses: free flight, rest, the acceleration of the last step once more, and rigid motion.
void ImplicitStep::choose_start() {
  const Objective& objective = newton_.objective;
  newton_.prepare();
  newton_.start(objective.targets);
  PackedVectors& guess = state_.guess;
  guess = state_.from;
  for (const int i : newton_.fixed()) guess.col(i) = objective.targets.col(i);
  newton_.offer(guess);
  if (state_.has_acceleration) {
    guess = state_.from + duration_ * particles_.velocities + duration_ * duration_ * state_.acceleration;
    newton_.offer(guess);
  }
  if (!is_free()) return;
  const RigidState rigid(particles_);
  const Vector3 turn = duration_ * rigid.angular_velocity(rigid.spin);
  const Real angle = turn.norm();
  if (!(angle > 0)) return;
  const Matrix3 rotation = Eigen::AngleAxis<Real>(angle, turn / angle).toRotationMatrix();
  const Vector3 center = rigid.center + duration_ * rigid.momentum / rigid.mass + duration_ * duration_ * body_.gravity;
  for (int i = 0; i < particles_.size(); ++i)
    guess.col(i).head<3>() = rotation * (state_.from.col(i).head<3>() - rigid.center) + center;
  newton_.offer(guess);
}

void ImplicitStep::minimize() {
  const Real tolerance2 = body_.options.newton_tolerance * body_.options.newton_tolerance;
  const Real stiffness = 1 / (duration_ * duration_) + body_.largest_eigenvalue;  // of inertia and elements, per mass
  const Real noise = round_off2 * body_.mass * stiffness * body_.rest_span.spreads.squaredNorm();
  Real enough = 0;
  for (int k = 0; k < body_.options.newton_iterations; ++k) {
    const NewtonIteration iteration = newton_.iterate();
    ++body_.report.newton_iterations;
    body_.report.linear_iterations += iteration.linear_iterations;
    if (k == 0) enough = std::max(tolerance2 * iteration.before, noise);
    if (iteration.length == 0 || iteration.after <= enough) break;
  }
}

// What the minimum, and iterations that end before it, take from the momenta of a free body.
void ImplicitStep::restore_momenta(const RigidState& before) {
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
  Vector3 momentum = before.momentum + duration_ * (before.mass * body_.gravity + force);
  Vector3 spin = before.spin + duration_ * torque;
  if (body_.external_forces.size() != 0)
    for (int i = 0; i < particles_.size(); ++i) {
      const Vector3 impulse = duration_ * body_.external_forces.col(i).head<3>();
      momentum += impulse;
      spin += (state_.from.col(i).head<3>() - before.center).cross(impulse);
    }
  const RigidState now(particles_);
  const Vector3 dv = (momentum - now.momentum) / now.mass, dw = now.angular_velocity(spin - now.spin);
  body_.report.restored_momentum = (momentum - now.momentum).norm();
  body_.report.restored_spin = (spin - now.spin).norm();
  for (int i = 0; i < particles_.size(); ++i) {
    const Vector3 arm = particles_.positions.col(i).head<3>() - now.center;
    particles_.velocities.col(i).head<3>() += dv + dw.cross(arm);
    particles_.positions.col(i).head<3>() += duration_ * dv;
  }
}

void ImplicitStep::cap_energy(Real allowed) {
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

void ImplicitStep::run() {
  state_.from = particles_.positions;
  aim();
  choose_start();
  minimize();
  const PackedVectors& end = newton_.positions();
  const RigidState before = is_free() ? RigidState(particles_) : RigidState();
  state_.acceleration = ((end - state_.from) / duration_ - particles_.velocities) / duration_;
  state_.has_acceleration = true;
  for (int i = 0; i < particles_.size(); ++i)
    if (particles_.inverse_masses[i] > 0) particles_.velocities.col(i) = (end.col(i) - state_.from.col(i)) / duration_;
  particles_.positions = end;
  if (is_free()) restore_momenta(before);

  body_.elastic_energy = newton_.elastic_energy();
  body_.forces = newton_.forces();
  for (const int i : newton_.fixed())
    body_.step_flows.driving -= duration_ * newton_.forces().col(i).dot(particles_.velocities.col(i));
  if (body_.external_forces.size() != 0) body_.forces += body_.external_forces;
  body_.step_flows.damping += newton_.damping_work();
  if (body_.field->evolves()) {
    const Real taken = body_.field->evolve(particles_.positions, duration_);
    body_.step_flows.inelastic += taken;
    if (taken != 0) evaluate_forces(body_);
  }
}

}  // namespace

void advance_implicitly(SteppedBody& body, Real duration) {
  const Real start_energy = begin_step(body);
  StepReport& report = body.report;
  report.integrator = Integrator::implicit_step;
  EnergyFlows& flows = body.step_flows;
  const auto attempt = [&](int substeps) {
    flows = {};
    ImplicitStep step(body, duration / substeps);
    for (int k = 0; k < substeps; ++k) step.run();
    flows.constant_forces = constant_force_work(body);
    const Real allowed = start_energy + flows.received() - flows.lost();
    // What drives pinned particles is known to the order of the step only.
    const bool is_driven = flows.driving != 0;
    if (!is_driven) step.cap_energy(allowed);
    const Real end_energy = body.elastic_energy + kinetic_energy(body.particles);
    const Real tolerance = is_driven ? body.options.energy_tolerance : growth_noise;
    return Attempt{.substeps = substeps,
                   .energy = end_energy,
                   .allowed = allowed,
                   .noise = tolerance * std::max(start_energy, end_energy) + body.energy_noise};
  };
  const GuardedStep step = guard_energy(1, start_energy, {.most_substeps = most_implicit_substeps, .factor = 2},
                                        attempt, [&] { undo_step(body); });
  report.substeps = step.attempt.substeps;
  report.retries = step.retries;
  report.finite = step.finite;
  if (step.finite) {
    flows.integration = step.attempt.allowed - step.attempt.energy;
  } else {
    SteppedBody* bodies[] = {&body};
    name_bad_particles(bodies);
    undo_step(body);
    flows = {};
    body.implicit.has_acceleration = false;
  }
  end_step(body, step.finite ? duration : 0);
}

}  // namespace penalty
