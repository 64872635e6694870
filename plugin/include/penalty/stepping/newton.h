// Projected Newton's method with a line search: the engine of the implicit step and of static relaxation.
#pragma once
#include "penalty/fields/potential_field.h"
#include "penalty/stepping/linear_solver.h"

namespace penalty {

class ImplicitContacts;

/// A soft body in the minimisation. Its matrices are kept from one to the next.
class NewtonBody {
 public:
  /// Makes the pattern of the matrix: once, and after elements were added.
  void set_pattern(const PotentialField& field);
  bool has_pattern_of(const PotentialField& field) const {
    return field_ == &field && num_elements_ == field.num_elements();
  }

  /// Of the preconditioner, see BodyMatrix.
  void limit_groups(int most);

  /// To be filled in before `NewtonSolver::prepare`; see Objective.
  std::vector<Real> weights;  // w_i [N/m]
  PackedVectors loads;        // f_i [N]
  PackedVectors damped_from;  // x0 [m]; empty: no damping
  Real damping_time = 0;      // of the elements, besides their own [s]

  /// Particles that do not move; to be added in ascending order.
  void clear_fixed() { matrix_.fixed.clear(); }
  void fix(int particle) { matrix_.fixed.push_back(particle); }
  const std::vector<int>& fixed() const { return matrix_.fixed; }

  int num_particles() const { return matrix_.num_particles(); }

  /// Its stiffness is assembled anew by the next iteration.
  void forget_stiffness() { has_stiffness_ = false; }
  bool has_stiffness() const { return has_stiffness_; }

  /// Whether the stiffness that was assembled last, for the same weights and elements, is nearly that at `x`: no particle
  /// has moved further than `distance` [m] against their mean.
  bool may_keep_stiffness(const Positions& x, Real distance) const;

  /// The diagonal block of a particle in the matrix that was assembled last, contacts left out [N/m].
  Matrix3 stiffness_of(int particle) const { return matrix_.values.blocks().diagonal(particle); }

 private:
  friend class NewtonSolver;
  void assemble(const Positions& x, StiffnessModel model, Real regularization);

  const PotentialField* field_ = nullptr;  // that the pattern was made of
  std::size_t num_elements_ = 0;
  int most_groups_ = BodyMatrix::most_groups;
  BodyMatrix matrix_;
  System damping_;
  bool has_stiffness_ = false, is_exact_ = false;
  PackedVectors assembled_at_;
  std::vector<Real> assembled_weights_;
  Real energy_noise_ = 0;  // of the potential, a guess [J]
};

/// What is minimised over the positions of the particles that are not fixed: the sum, over all bodies, of
///
///     Phi(x) = E(x) + sum_i w_i/2 |x_i - t_i|² - sum_i f_i . x_i + (x - x0)ᵀ D (x - x0) / 2
///
/// E is the energy of the field; the implicit step has w_i = m_i / h² and t_i where particle i would be without forces;
/// damping has D = damping matrix / h at x0, where the step began. Contacts add a potential of their own. The columns of x
/// are the particles, body by body; rigid bodies that they touch have two columns each after those: translation and rotation
/// vector since the step began; their inertia takes the place of w_i. Whatever is empty is left out.
struct Objective {
  std::vector<NewtonBody*> bodies;
  PackedVectors targets;                   // t_i [m], and of rigid bodies
  Real inverse_duration = 0;               // 1 / h [1/s]
  std::vector<RigidInertia> rigid_bodies;  // mass / h² and moments of inertia / h²
  ImplicitContacts* contacts = nullptr;
};

/// One iteration, from x to x + length * d.
struct NewtonIteration {
  Real displacement = 0;  // largest |d_i| of a particle [m]
  Real length = 0;        // 0: no way down was found
  int linear_iterations = 0;
};

/// Minimises by Newton's method. The stiffness of every element is projected on the positive semidefinite matrices, so that
/// each direction leads downhill; or it is exact as long as the whole matrix turns out positive definite, which takes fewer
/// iterations. The line search makes sure that Phi falls, or, where that is lost in round-off, its slope. Deterministic, and
/// without allocation once the pattern is made and a step was taken.
class NewtonSolver {
 public:
  /// To be filled in before `prepare`, which makes the damping matrices. The pattern of each body is to be there.
  Objective objective;
  void prepare();

  LinearOptions linear;
  /// Share of the mean stiffness that is added to the diagonal: what has no inertia may be free to move.
  Real regularization = 0;

  /// Whether the exact stiffness is tried, too.
  bool tries_exact = false;

  /// Begins at `x`, or, if Phi is less there, moves to `x`.
  void start(const PackedVectors& x);
  void offer(const PackedVectors& x);

  /// With the stiffness of here.
  NewtonIteration iterate();

  /// The two halves of an iteration, between which the preconditioner is that of here. Bodies that have a stiffness keep it.
  void linearize();
  NewtonIteration descend();

  /// Of bodies that have none, at `x`.
  void assemble(const PackedVectors& x);

  /// dPhi . P⁻¹ dPhi, with the last preconditioner: about twice what Phi could still fall by [J].
  Real squared_residual() { return solver_.squared_norm(here_.gradient); }
  /// What some columns have of that, when it was computed last.
  Real residual_share(Eigen::Index first, Eigen::Index count) const {
    return solver_.share_of_norm(here_.gradient, first, count);
  }

  /// After contacts have changed.
  void evaluate_again() { evaluate(here_); }

  /// Of the last iteration [m].
  const PackedVectors& direction() const { return direction_; }

  const PackedVectors& positions() const { return here_.positions; }  // columns of rigid bodies included
  const PackedVectors& forces() const { return here_.forces; }        // -dE/dx, of particles [N]
  const PackedVectors& gradient() const { return here_.gradient; }    // dPhi/dx, zero of fixed particles [N]
  Real elastic_energy(std::size_t body = 0) const { return here_.bodies[body].elastic_energy; }  // E [J]
  Real value() const { return here_.value; }                                                     // Phi [J]

  /// (x - x0)ᵀ D (x - x0): what damping has taken of a body since x0, were it linear on the way [J].
  Real damping_work(std::size_t body) const { return 2 * here_.bodies[body].damping; }

 private:
  struct OfBody {
    Real elastic_energy = 0, damping = 0;
  };
  struct State {
    PackedVectors positions, forces, gradient;
    std::vector<OfBody> bodies;
    Real value = 0;
    Real magnitude = 0;  // of the terms of the value: what round-off is measured by
  };

  void evaluate(State& state);
  OfBody evaluate(const NewtonBody& body, Eigen::Index first, State& state);
  bool leave_exact();

  LinearSystem system_;
  LinearSolver solver_;
  int projected_ = 0;  // assemblies that are to be projected
  State here_, trial_;
  PackedVectors direction_, right_side_, displacement_, damping_force_;
};

}  // namespace penalty
