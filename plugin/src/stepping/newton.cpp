#include "penalty/stepping/newton.h"

#include <algorithm>
#include <cmath>

#include "implicit_contacts.h"

namespace penalty {
namespace {

constexpr Real sufficient = 1e-4;  // share of the predicted fall that a step has to keep (Armijo)
constexpr int most_backtracks = 30;
constexpr Real round_off = 1e-13;  // of the terms of Phi: below it the slope decides instead
constexpr Real epsilon = 1e-16;

}  // namespace

void NewtonSolver::set_pattern(const PotentialField& field) {
  field_ = nullptr;  // until all of it is there
  has_stiffness_ = false;
  const int num_particles = field.num_particles();
  system_.matrix = System::with_pattern(num_particles, [&](System& system) {
    field.add_stiffness(field.rest_positions(), StiffnessModel::psd_projected, system);
    field.add_damping(field.rest_positions(), 1, system);
  });
  damping_ = system_.matrix;
  solver_.set_pattern(system_.matrix.blocks());
  for (PackedVectors* v : {&here_.positions, &here_.forces, &here_.gradient, &trial_.positions, &trial_.forces,
                           &trial_.gradient, &direction_, &right_side_, &displacement_, &damping_force_})
    v->setZero(4, num_particles);
  num_elements_ = field.num_elements();
  field_ = &field;
}

void NewtonSolver::evaluate(State& state) {
  const Eigen::Index num_particles = state.forces.cols();
  const auto x = state.positions.leftCols(num_particles);
  state.forces.setZero();
  state.elastic_energy = objective.field->add_forces(x, state.forces);
  state.gradient.resize(4, state.positions.cols());
  auto gradient = state.gradient.leftCols(num_particles);
  gradient = -state.forces;
  state.value = state.elastic_energy;
  state.magnitude = state.elastic_energy;
  if (!objective.weights.empty()) {
    Real inertia = 0;
    for (Eigen::Index i = 0; i < num_particles; ++i) {
      const Real w = objective.weights[static_cast<std::size_t>(i)];
      const Vector3 d = (x.col(i) - objective.targets.col(i)).head<3>();
      inertia += w * d.squaredNorm();
      gradient.col(i).head<3>() += w * d;
    }
    Eigen::Index column = num_particles;
    for (const auto& [translation, rotation] : objective.rigid_bodies)
      for (const Matrix3* block : {&translation, &rotation}) {
        const Vector3 d = (state.positions.col(column) - objective.targets.col(column)).head<3>();
        const Vector3 force = *block * d;
        inertia += d.dot(force);
        state.gradient.col(column++) << force, 0;
      }
    state.value += inertia / 2;
    state.magnitude += inertia / 2;
  }
  if (objective.loads.size() != 0) {
    const Real work = objective.loads.cwiseProduct(x).sum();
    gradient -= objective.loads;
    state.value -= work;
    state.magnitude += objective.loads.cwiseProduct(x).cwiseAbs().sum();
  }
  state.damping = 0;
  if (objective.damped_from.size() != 0) {
    displacement_ = x - objective.damped_from;
    damping_force_.setZero();
    damping_.add_product(displacement_, 1, damping_force_);
    state.damping = displacement_.cwiseProduct(damping_force_).sum() / 2;
    gradient += damping_force_;
    state.value += state.damping;
    state.magnitude += state.damping;
  }
  if (objective.contacts) {
    const Real energy = objective.contacts->evaluate(state.positions, state.gradient);
    state.value += energy;
    state.magnitude += std::abs(energy);
  }
  system_.clear_fixed(state.gradient);
}

void NewtonSolver::prepare() {
  if (objective.damped_from.size() != 0) {
    damping_.set_zero();
    objective.field->add_damping(objective.damped_from, objective.damping_time, damping_);
    damping_.scale(objective.inverse_duration);
  }
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

void NewtonSolver::assemble() {
  System& matrix = system_.matrix;
  matrix.set_zero();
  const int num_particles = matrix.num_particles();
  const auto positions = here_.positions.leftCols(num_particles);
  objective.field->add_stiffness(positions, StiffnessModel::psd_projected, matrix);
  if (objective.damped_from.size() != 0) matrix.add(damping_);
  Real stiffness = 0;
  for (int i = 0; i < num_particles; ++i) stiffness += matrix.blocks().diagonal(i).trace() / 3;
  const Real shift = regularization * stiffness / std::max(num_particles, 1);
  // A turned body has F far from 1, and energies of elements that are small differences of large numbers.
  const auto x = positions.topRows<3>();
  energy_noise_ = epsilon * stiffness * (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).squaredNorm();
  for (int i = 0; i < num_particles; ++i) {
    const Real weight = objective.weights.empty() ? 0 : objective.weights[i];
    matrix.add_to_diagonal(i, weight + shift);
  }
  has_stiffness_ = true;
  assembled_at_ = positions;
  assembled_weights_ = objective.weights;
}

void NewtonSolver::linearize(bool keeps_stiffness) {
  if (!keeps_stiffness) assemble();
  system_.rigid_bodies = objective.rigid_bodies;
  system_.contacts.clear();
  right_side_ = -here_.gradient;
  if (objective.contacts) objective.contacts->linearize(here_.positions, system_.contacts, right_side_);
  if (keeps_stiffness)
    solver_.factorize_contacts(system_);
  else
    solver_.factorize(system_, here_.positions.leftCols(system_.matrix.num_particles()));
}

Real NewtonSolver::squared_residual() { return solver_.squared_norm(system_, here_.gradient); }

bool NewtonSolver::may_keep_stiffness(const PackedVectors& x, Real distance) const {
  if (!has_stiffness_ || assembled_weights_ != objective.weights) return false;
  const auto moved = x.leftCols(assembled_at_.cols()) - assembled_at_;
  const Eigen::Matrix<Real, 4, 1> shift = moved.rowwise().mean();
  return !((moved.colwise() - shift).colwise().squaredNorm().maxCoeff() > distance * distance);
}

NewtonIteration NewtonSolver::descend() {
  NewtonIteration iteration;
  const LinearReport solved = solver_.solve(system_, right_side_, linear, direction_);
  iteration.linear_iterations = solved.iterations;
  iteration.before = solved.squared_norm;
  const Real slope = here_.gradient.cwiseProduct(direction_).sum();
  if (!(slope < 0)) return iteration;
  const auto of_particles = direction_.leftCols(system_.matrix.num_particles());
  iteration.displacement = std::sqrt(of_particles.colwise().squaredNorm().maxCoeff());

  Real length = objective.contacts ? objective.contacts->longest(direction_) : 1;
  for (int k = 0; k < most_backtracks; ++k) {
    trial_.positions = here_.positions + length * direction_;
    evaluate(trial_);
    const Real fall = here_.value - trial_.value;
    const Real new_slope = trial_.gradient.cwiseProduct(direction_).sum();
    const bool falls = fall >= -sufficient * length * slope;
    const bool flat =
        std::abs(fall) <= round_off * here_.magnitude + energy_noise_ && std::abs(new_slope) < -0.9 * slope;
    if (falls || flat) {
      std::swap(here_, trial_);
      iteration.length = length;
      iteration.after = squared_residual();
      return iteration;
    }
    // The parabola through both values and the first slope, within reason.
    const Real parabola = -slope * length / (2 * (-fall / length - slope));
    length = std::isfinite(parabola) ? std::clamp(parabola, 0.1 * length, 0.5 * length) : 0.1 * length;
  }
  return iteration;
}

}  // namespace penalty
