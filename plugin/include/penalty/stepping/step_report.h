// What a step did.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "penalty/stepping/step_options.h"

namespace penalty {

/// What a step did to a body; of an island: the sums and the extremes of its bodies.
struct StepReport {
  Integrator integrator = Integrator::explicit_step;  // that was used
  int substeps = 0;                                   // of the step that was kept
  int newton_iterations = 0;                          // of an implicit step, over its substeps
  int linear_iterations = 0;                          // of conjugate gradients, likewise
  bool unfolded = false;                              // particles were moved out of a plane, a line or a point
  int retries = 0;                                    // by the energy guard
  bool finite = true;                                 // false: the step was undone, the state is that of its start
  int first_bad_particle = -1;  // when not finite: the first such particle at the start, else the fastest
  Real damping_share = 1;       // least share of the damping that was asked for, that an explicit step could give
  Real elastic_energy = 0;      // at the end [J]
  Real kinetic_energy = 0;      // at the end, without rigid bodies [J]
  /// Largest depth at the end [m], of a node below a plane that is a margin outside a rigid body, of what surfaces have
  /// lost of the distance that they keep, or of a point inside a closed surface, that distance included. Of edges that
  /// pierce a surface, and of what has passed an open one, nothing is known.
  Real contact_depth = 0;
  int num_contacts = 0;      // contacts that were considered
  std::string problem = {};  // what is wrong, on one line; the body then stays where it is until it is mended

  // What an implicit step set right after its minimum was found; the last substep's.
  Real restored_momentum = 0;  // given back to a free body [kg m/s]: what Newton iterations that end early took
  Real restored_spin = 0;      // likewise, about the centre of mass [kg m²/s]: that, and what backward Euler takes
  Real capped_energy = 0;      // that had grown, and was taken from the velocities [J]
};

/// Energy that a body has received and lost [J]. Elastic and kinetic energy together are what they were at the start
/// plus `received() - lost()`, but for the error of the integrator, in explicit steps. Implicit ones have
/// `integration`, which is whatever closes their books: there the balance says nothing, and its size does.
struct EnergyFlows {
  Real constant_forces = 0;  // work of gravity and external forces
  Real contacts = 0;         // work of contacts on the body: rigid bodies give and take, impact and friction take
  Real couplings = 0;        // work of couplings on the body
  Real driving = 0;          // work of whoever moves pinned particles
  Real changes = 0;       // between steps, by the application and by Bullet: positions, velocities, targets, elements
  Real damping = 0;       // lost along the constraint gradients
  Real drag = 0;          // lost to the drag of the step
  Real inelastic = 0;     // lost to plastic flow and breaking
  Real integration = 0;   // lost to the numerical damping of implicit steps, by definition what is left over
  Real contact_loss = 0;  // lost to impact and friction, less what restitution gave back: already in `contacts`

  Real received() const { return constant_forces + contacts + couplings + driving + changes; }
  Real lost() const { return damping + drag + inelastic + integration; }
  EnergyFlows& operator+=(const EnergyFlows& other);

  /// All of them, by name.
  struct Part {
    std::string_view name;
    Real EnergyFlows::* member;
  };
  static std::span<const Part> parts();
};

}  // namespace penalty
