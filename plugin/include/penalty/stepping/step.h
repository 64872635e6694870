// One world step: many explicit substeps, or one implicit one.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "penalty/fields/potential.h"
#include "penalty/math/affine_span.h"
#include "penalty/stepping/contact.h"
#include "penalty/stepping/newton.h"

namespace penalty {

enum class Integrator {
  automatic,      // explicit up to `crossover_substeps`, else implicit
  explicit_step,  // sub-cycled velocity Verlet
  implicit_step,  // backward Euler; where something touches the body or couples it to others: explicit
};

/// Substeps up to which sub-cycling costs less than an implicit step with its default options: as many were measured to
/// cost the same in a body of 1280 tetrahedra (81) and in one of 10240 (124).
inline constexpr int crossover_substeps = 100;

/// How a body is stepped. Nothing damps by default; `damping_time` and `drag` do. (Far from rest the energy guard still takes
/// a little: it repeats steps that gain energy, not those that lose it.)
struct StepOptions {
  Integrator integrator = Integrator::automatic;
  Real damping_time = 0;          // ratio of damping to stiffness along the constraint gradients, beta [s]
  Real drag = 0;                  // rate at which all velocities decay [1/s]; does not keep momentum
  int substeps = 0;               // in a step; 0: from the stability limit
  Real safety = 0.99;             // share of the stability limit that a substep may use, in (0, 1]
  Real contact_safety = 0.7;      // the same while the body is in contact: impacts excite the fastest modes
  Real energy_tolerance = 0.005;  // relative growth of energy in a step above which it is repeated with more substeps
  int max_substeps = 20000;       // beyond this a step is taken as it is, if it is finite
  Real contact_slop = 1e-4;       // depth that is left alone [m]
  int newton_iterations = 8;      // most of an implicit step
  Real newton_tolerance =
      1e-3;  // ends them: what is left of the forces that are not balanced, in the norm of the preconditioner
  LinearOptions linear = {};  // of each Newton iteration
  bool unfold = true;         // out of a plane, a line or a point: see penalty::unfold

  /// Throws std::invalid_argument that names the option and its value.
  void check() const;
};

/// What a step did.
struct StepReport {
  Integrator integrator = Integrator::explicit_step;  // that was used
  int substeps = 0;                                   // of the step that was kept
  int newton_iterations = 0;                          // of an implicit step, over its substeps
  int linear_iterations = 0;                          // of conjugate gradients, likewise
  bool unfolded = false;                              // particles were moved out of a plane, a line or a point
  int retries = 0;                                    // by the energy guard
  bool finite = true;                                 // false: the step was undone, the state is that of its start
  int first_bad_particle = -1;  // when not finite: the first such particle at the start, else the fastest
  Real elastic_energy = 0;      // at the end [J]
  Real kinetic_energy = 0;      // at the end, without rigid bodies [J]
  Real contact_depth = 0;       // largest depth below a contact plane [m]
  int num_contacts = 0;         // contacts that were considered
  std::string problem =
      {};  // what is wrong, on one line; empty: nothing. The body stays where it is until it is mended
};

/// Energy that a body has received and lost [J]. Elastic and kinetic energy together are what they were at the start plus
/// `received() - lost()`, but for the error of the integrator.
struct EnergyFlows {
  Real constant_forces = 0;  // work of gravity and external forces
  Real contacts = 0;         // work of contacts on the body: rigid bodies give and take, impact and friction take
  Real couplings = 0;        // work of couplings on the body
  Real driving = 0;          // work of whoever moves pinned particles
  Real changes = 0;       // between steps, by the application and by Bullet: positions, velocities, targets, elements
  Real damping = 0;       // lost along the constraint gradients
  Real drag = 0;          // lost to the drag of the step
  Real inelastic = 0;     // lost to plastic flow and breaking
  Real integration = 0;   // lost to the numerical damping of implicit steps: what balances their books
  Real contact_loss = 0;  // lost to impact and friction where the body touches: already in `contacts`

  Real received() const { return constant_forces + contacts + couplings + driving + changes; }
  Real lost() const { return damping + drag + inelastic + integration; }
  EnergyFlows& operator+=(const EnergyFlows& other);

  /// All of them, by name.
  struct Part {
    std::string_view name;
    Real EnergyFlows::*member;
  };
  static std::span<const Part> parts();
};

/// What implicit steps keep between steps.
struct ImplicitState {
  NewtonSolver newton;
  PackedVectors acceleration;  // mean one of the last step [m/s²]
  bool has_acceleration = false;
  PackedVectors from, guess;  // what the step works in
};

/// One body of an island: its state, its potential and what the integrator remembers of it between steps. The potential
/// outlives the body.
struct SteppedBody {
  Particles particles;
  Potential* potential = nullptr;
  StepOptions options;
  Vector3 gravity = Vector3::Zero();  // [m/s²]
  PackedVectors external_forces;      // constant over the step [N]; empty: none
  Real largest_eigenvalue = 0;        // of M^-1 K at rest, an upper bound [1/s²]: see estimate_stability
  std::vector<Contact> contacts;      // of this step
  StepReport report;                  // of the last step
  EnergyFlows flows;                  // of all steps

  /// Forgets what was computed at earlier positions: call after changing positions, external forces or the potential.
  void positions_changed() { forces_valid = false; }

  // What the integrator keeps between steps.
  PackedVectors forces;  // at `particles.positions`, external ones included [N]
  Real elastic_energy = 0;
  bool forces_valid = false;
  EnergyFlows step_flows;              // of the attempt at the present step
  std::optional<Real> last_energy;     // at the end of the last step [J]
  int last_substeps = 0;               // what the energy guard settled on
  Real mass = 0;                       // of the particles that are not pinned [kg]
  Real energy_noise = 0;               // growth of energy that means nothing [J]
  Particles start;                     // positions and velocities to go back to
  std::vector<RigidBody> rigid_start;  // likewise for the rigid bodies of its island
  PackedVectors rest_positions;        // as `estimate_stability` was told [m]
  AffineSpan rest_span;
  ImplicitState implicit;
};

/// A point that a coupling holds: a particle of a body of the island, or a point fixed in one of its rigid bodies.
struct CoupledPoint {
  int body = -1, particle = -1;      // index into the bodies of the island; -1: of a rigid body
  int rigid_body = -1;               // index into the rigid bodies of the island
  Vector3 anchor = Vector3::Zero();  // in the frame of the rigid body [m]
};

/// A potential over points of several bodies: attachments, joints of flesh and bone. Particle i of the potential is point i;
/// no two points are the same particle. Rigid bodies get the reaction.
struct Coupling {
  std::vector<CoupledPoint> points;
  Potential* potential = nullptr;
  Real damping_time = 0;        // as in StepOptions [s]
  Real largest_eigenvalue = 0;  // see estimate_stability [1/s²]
  Real elastic_energy = 0;      // at the end of the last step [J]

  // What the integrator works in.
  bool has_driven_points = false;  // points of no mobility, which may be moved
  PackedVectors positions, velocities, previous_velocities, forces;
  std::vector<Real> inverse_masses;  // of a rigid body's point: no less than its mobility in any direction
};

/// Sets the inverse masses of the points and, if they changed or `anew`, `largest_eigenvalue` from the Gershgorin row sums of
/// the stiffness at the rest positions of the potential's points: bodies turn against each other, and these do not depend
/// on directions.
void estimate_stability(Coupling& coupling, std::span<SteppedBody* const> bodies,
                        std::span<const RigidBody> rigid_bodies, const Positions& rest_positions, bool anew);

/// Sets `largest_eigenvalue` from the stiffness at the rest positions. Call once, and after a change of masses, stiffness or
/// elements.
void estimate_stability(SteppedBody& body, const Positions& rest_positions);

/// Advances bodies that touch the same rigid bodies or are coupled over `duration` [s], together with these rigid bodies.
///
/// Explicitly: equal substeps of velocity Verlet (kick, drift, kick), with one sweep of contacts before each drift. At the
/// start and the end positions and velocities belong to the same instant, and only there, or at the end of a block of
/// substeps, is damping applied: touched half a substep apart, it would feed the fastest modes. The number of substeps
/// follows from the stability limit 2 / sqrt(largest_eigenvalue) and the safety of each body. That limit belongs to the
/// rest shape; far from it a step may still gain energy. If kinetic + elastic energy, less the work of gravity and
/// obstacles, grows beyond the tolerance or is not finite, the step is undone and repeated with half as many substeps
/// again; the next step starts from at least 0.8 of that number. Plastic flow and breaking happen at the end of a
/// block, up to eight times a step; what they take is no growth.
///
/// Implicitly, a body by itself, see Integrator: the positions at the end minimise
///
///     Phi(x) = sum_i m_i / 2h² |x_i - (x + h v + h² a)_i|² + E(x) + (x - x0)ᵀ D (x - x0) / 2h
///
/// by projected Newton iterations with a line search. Unlike that minimum, which turns too slowly, the step keeps the angular
/// momentum of a free body, and the linear one in spite of iterations that end early: a rigid velocity is added. Energy
/// that would grow all the same is taken from the velocities that deform the body.
///
/// Linear and angular momentum of free bodies and touched rigid ones are kept to round-off, but for the gyroscopic term
/// of a rigid body with unequal moments of inertia, which is left to Bullet. A step that cannot be made
/// finite is undone and reported, never handed on.
void advance(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration,
             std::span<Coupling* const> couplings = {});

}  // namespace penalty
