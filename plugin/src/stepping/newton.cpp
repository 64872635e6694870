#include "penalty/stepping/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "implicit_contacts.h"

namespace penalty {
namespace {

constexpr Real sufficient = 1e-4;  // share of the predicted fall that a step has to keep (Armijo)
constexpr int most_trials = 30;
constexpr Real steep = 0.85;       // share of the slope that is left where a step ended far short of a bend of Phi
constexpr Real close = 0.05;       // to the bend: what is left of a step that was too long, by what was taken
constexpr Real round_off = 1e-13;  // of the terms of Phi: below it the slope decides instead
constexpr Real epsilon = 1e-16;
constexpr int projected_at_once = 4;  // assemblies, where the exact stiffness was not positive definite

}  // namespace

void NewtonBody::set_pattern(const PotentialField& field) {
  field_ = nullptr;  // until all of it is there
  has_stiffness_ = false;
  matrix_.values = System::with_pattern(field.num_particles(), [&](System& system) {
    field.add_stiffness(field.rest_positions(), StiffnessModel::psd_projected, system);
    field.add_damping(field.rest_positions(), 1, system);
  });
  damping_ = matrix_.values;
  matrix_.make_groups(most_groups_);
  num_elements_ = field.num_elements();
  field_ = &field;
}

void NewtonBody::limit_groups(int most) {
  if (most == most_groups_) return;
  most_groups_ = most;
  matrix_.make_groups(most);
  has_stiffness_ = false;
}

void NewtonBody::assemble(const Positions& positions, StiffnessModel model, Real regularization) {
  System& matrix = matrix_.values;
  const int num_particles = matrix.num_particles();
  matrix.set_zero();
  field_->add_stiffness(positions, model, matrix);
  if (damped_from.size() != 0) matrix.add(damping_);
  Real stiffness = 0;
  for (int i = 0; i < num_particles; ++i) stiffness += matrix.blocks().diagonal(i).trace() / 3;
  const Real shift = regularization * stiffness / std::max(num_particles, 1);
  // A turned body has F far from 1, and energies of elements that are small differences of large numbers.
  const auto x = positions.topRows<3>();
  energy_noise_ = epsilon * stiffness * (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).squaredNorm();
  for (int i = 0; i < num_particles; ++i) matrix.add_to_diagonal(i, (weights.empty() ? 0 : weights[i]) + shift);
  matrix_.factorize(positions);
  has_stiffness_ = true;
  is_exact_ = model == StiffnessModel::exact;
  assembled_at_ = positions;
  assembled_weights_ = weights;
}

bool NewtonBody::may_keep_stiffness(const Positions& x, Real distance) const {
  if (!has_stiffness_ || assembled_weights_ != weights) return false;
  const auto moved = x - assembled_at_;
  const Eigen::Matrix<Real, 4, 1> shift = moved.rowwise().mean();
  return !((moved.colwise() - shift).colwise().squaredNorm().maxCoeff() > distance * distance);
}

// Adds to the value, and sets the columns of the body.
NewtonSolver::OfBody NewtonSolver::evaluate(const NewtonBody& body, Eigen::Index first, State& state) {
  const Eigen::Index count = body.num_particles();
  const auto x = state.positions.middleCols(first, count);
  auto forces = state.forces.middleCols(first, count), gradient = state.gradient.middleCols(first, count);
  OfBody sum{.elastic_energy = body.field_->add_forces(x, forces)};
  gradient = -forces;
  state.value += sum.elastic_energy;
  state.magnitude += sum.elastic_energy;
  if (!body.weights.empty()) {
    Real inertia = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Real w = body.weights[static_cast<std::size_t>(i)];
      const Vector3 d = (x.col(i) - objective.targets.col(first + i)).head<3>();
      inertia += w * d.squaredNorm();
      gradient.col(i).head<3>() += w * d;
    }
    state.value += inertia / 2;
    state.magnitude += inertia / 2;
  }
  if (body.loads.size() != 0) {
    gradient -= body.loads;
    state.value -= body.loads.cwiseProduct(x).sum();
    state.magnitude += body.loads.cwiseProduct(x).cwiseAbs().sum();
  }
  if (body.damped_from.size() != 0) {
    auto displacement = displacement_.middleCols(first, count), force = damping_force_.middleCols(first, count);
    displacement = x - body.damped_from;
    force.setZero();
    body.damping_.add_product(displacement, 1, force);
    sum.damping = displacement.cwiseProduct(force).sum() / 2;
    gradient += force;
    state.value += sum.damping;
    state.magnitude += sum.damping;
  }
  return sum;
}

void NewtonSolver::evaluate(State& state) {
  const Eigen::Index num_particles = displacement_.cols();
  state.forces.setZero(4, num_particles);
  state.gradient.resize(4, state.positions.cols());
  state.bodies.resize(objective.bodies.size());
  state.value = state.magnitude = 0;
  Eigen::Index column = 0;
  for (std::size_t k = 0; const NewtonBody* body : objective.bodies) {
    state.bodies[k++] = evaluate(*body, column, state);
    column += body->num_particles();
  }
  for (const auto& [translation, rotation] : objective.rigid_bodies)
    for (const Matrix3* block : {&translation, &rotation}) {
      const Vector3 d = (state.positions.col(column) - objective.targets.col(column)).head<3>();
      const Vector3 force = *block * d;
      state.value += d.dot(force) / 2;
      state.magnitude += d.dot(force) / 2;
      state.gradient.col(column++) << force, 0;
    }
  if (objective.contacts) {
    const Real energy = objective.contacts->evaluate(state.positions, state.gradient);
    state.value += energy;
    state.magnitude += std::abs(energy);
  }
  system_.clear_fixed(state.gradient);
}

void NewtonSolver::prepare() {
  projected_ = 0;
  system_.bodies.clear();
  for (NewtonBody* body : objective.bodies) {
    system_.bodies.push_back(&body->matrix_);
    if (body->damped_from.size() == 0) continue;
    body->damping_.set_zero();
    body->field_->add_damping(body->damped_from, body->damping_time, body->damping_);
    body->damping_.scale(objective.inverse_duration);
  }
  for (PackedVectors* v : {&displacement_, &damping_force_}) v->resize(4, system_.num_particles());
}

void NewtonSolver::start(const PackedVectors& x) {
  here_.positions = x;
  evaluate(here_);
}

void NewtonSolver::offer(const PackedVectors& x) {
  trial_.positions = x;
  evaluate(trial_);
  if (trial_.value < here_.value || std::isnan(here_.value)) std::swap(here_, trial_);
}

void NewtonSolver::assemble(const PackedVectors& x) {
  const StiffnessModel model = tries_exact && projected_ == 0 ? StiffnessModel::exact : StiffnessModel::psd_projected;
  Eigen::Index first = 0;
  bool any = false;
  for (NewtonBody* body : objective.bodies) {
    const Eigen::Index count = body->num_particles();
    if (!body->has_stiffness()) {
      body->assemble(x.middleCols(first, count), model, regularization);
      any = true;
    }
    first += count;
  }
  if (any && projected_ > 0) --projected_;
}

// Returns whether there was any exact stiffness, which is forgotten.
bool NewtonSolver::leave_exact() {
  bool any = false;
  for (NewtonBody* body : objective.bodies)
    if (body->is_exact_ && body->has_stiffness()) {
      body->forget_stiffness();
      any = true;
    }
  if (any) projected_ = projected_at_once;
  return any;
}

void NewtonSolver::linearize() {
  do {
    assemble(here_.positions);
    system_.rigid_bodies = objective.rigid_bodies;
    system_.contacts.clear();
    right_side_ = -here_.gradient;
    if (objective.contacts) objective.contacts->linearize(here_.positions, system_.contacts, right_side_);
  } while (!solver_.factorize(system_) && leave_exact());
}

NewtonIteration NewtonSolver::iterate() {
  for (NewtonBody* body : objective.bodies) body->forget_stiffness();
  linearize();
  return descend();
}

NewtonIteration NewtonSolver::descend() {
  NewtonIteration iteration;
  iteration.linear_iterations = solver_.solve(system_, right_side_, linear, direction_);
  if (!solver_.was_positive() && leave_exact()) {
    linearize();
    iteration.linear_iterations += solver_.solve(system_, right_side_, linear, direction_);
  }
  Real slope = here_.gradient.cwiseProduct(direction_).sum();
  if (!(slope < 0)) return iteration;
  const auto of_particles = direction_.leftCols(system_.num_particles());
  iteration.displacement = std::sqrt(of_particles.colwise().squaredNorm().maxCoeff());

  Real energy_noise = 0;
  for (const NewtonBody* body : objective.bodies) energy_noise += body->energy_noise_;
  // Contacts bend Phi sharply. Where a step was too long and the next one hardly changes the slope, the bend is in between:
  // short steps alone would creep up to it.
  Real length = objective.contacts ? objective.contacts->longest(direction_) : 1;
  Real too_long = std::numeric_limits<Real>::infinity();
  for (int k = 0; k < most_trials; ++k) {
    trial_.positions = here_.positions + length * direction_;
    evaluate(trial_);
    const Real fall = here_.value - trial_.value;
    const Real new_slope = trial_.gradient.cwiseProduct(direction_).sum();
    const bool falls = fall >= -sufficient * length * slope;
    const bool flat =
        std::abs(fall) <= round_off * here_.magnitude + energy_noise && std::abs(new_slope) < -0.9 * slope;
    if (falls || flat) {
      std::swap(here_, trial_);
      iteration.length += length;
      too_long -= length;
      const bool creeps = objective.contacts && std::isfinite(too_long) && new_slope <= steep * slope;
      if (flat || !creeps || !(too_long > close * iteration.length)) break;
      slope = new_slope;
      length = 0.5 * too_long;
    } else {
      too_long = length;
      // The parabola through both values and the first slope, within reason.
      const Real parabola = -slope * length / (2 * (-fall / length - slope));
      length = std::isfinite(parabola) ? std::clamp(parabola, 0.1 * length, 0.5 * length) : 0.1 * length;
    }
  }
  return iteration;
}

}  // namespace penalty
