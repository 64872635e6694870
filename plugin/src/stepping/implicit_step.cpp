#include "implicit_step.h"

#include <algorithm>
#include <limits>

#include "backward_euler.h"
#include "energy_guard.h"
#include "implicit_surfaces.h"
#include "particle_contacts.h"
#include "restitution.h"
#include "rigid_contacts.h"
#include "stepped_body.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr int most_implicit_substeps = 16;  // of a step whose energy would grow
constexpr Real growth_noise = 1e-12;        // relative growth of energy that is round-off

// What contacts took is shared as their rows say; what else is missing, damping has taken, or the integrator.
void book_losses(Island& island, Real contact_loss) {
  Real of_rows = 0;
  for (const SteppedBody* body : island.bodies) of_rows += body->step_flows.contact_loss;
  for (SteppedBody* body : island.bodies) {
    EnergyFlows& flows = body->step_flows;
    const Real share = of_rows > 0 ? flows.contact_loss / of_rows : 1 / static_cast<Real>(island.bodies.size());
    flows.contact_loss = share * contact_loss;
    const Real end_energy = body->elastic_energy + kinetic_energy(body->particles);
    const Real missing = *body->last_energy + flows.received() - (flows.lost() - flows.damping) - end_energy;
    flows.damping = std::clamp<Real>(missing, 0, flows.damping);
    flows.integration = missing - flows.damping;
  }
}

}  // namespace

bool advance_implicitly(Island& island, ImplicitSurfaces& surfaces, Real duration) {
  island.rigid_start = island.rigid_bodies;
  Real start_energy = 0, energy_noise = 0, energy_tolerance = std::numeric_limits<Real>::infinity();
  for (SteppedBody* body : island.bodies) {
    start_energy += begin_step(*body, island.bodies.size() == 1);
    energy_noise += body->energy_noise;
    energy_tolerance = std::min(energy_tolerance, body->options.energy_tolerance);
    body->implicit.contacts_at_start = body->implicit.contacts;
    body->implicit.anchors_at_start = body->implicit.anchors;
    body->report.integrator = Integrator::implicit_step;
  }
  RigidContacts rigid_contacts(island);
  const auto rigid_energy = [&island] {
    Real sum = 0;
    for (const RigidBody& rigid : island.rigid_bodies) sum += kinetic_energy(rigid);
    return sum;
  };
  const Real start_rigid_energy = rigid_energy();
  const auto undo = [&] {
    island.rigid_bodies = island.rigid_start;
    for (SteppedBody* body : island.bodies) {
      undo_step(*body);
      body->implicit.newton.forget_stiffness();
      body->implicit.contacts = body->implicit.contacts_at_start;
      body->implicit.anchors = body->implicit.anchors_at_start;
    }
    surfaces.undo();
  };
  Real contact_loss = 0;  // what contacts took from all bodies [J]
  bool is_separated = true;
  const auto attempt = [&](int substeps) {
    for (SteppedBody* body : island.bodies) body->step_flows = {};
    for (Contact& contact : island.contacts) contact.given = {};
    rigid_contacts.begin_attempt();
    if (island.surface_scratch) island.surface_scratch->records.clear();
    BackwardEuler step(island, surfaces, duration / substeps);
    is_separated = true;
    for (int k = 0; k < substeps && is_separated; ++k) is_separated = step.run();
    contact_loss = step.outside_work() - (rigid_energy() - start_rigid_energy);
    for (std::size_t k = 0; k < island.rigid_bodies.size(); ++k)
      contact_loss += work_of_accelerations(island.rigid_bodies[k], island.rigid_start[k]);
    // What contacts and damping take is not asked for: of a body that turns on its way, the latter is not what its work is.
    Real allowed = start_energy + contact_loss;
    bool is_driven = false;
    for (SteppedBody* body : island.bodies) {
      EnergyFlows& flows = body->step_flows;
      flows.constant_forces = constant_force_work(*body);
      contact_loss -= flows.contacts;
      allowed += flows.received() - flows.contacts - (flows.lost() - flows.damping);
      is_driven = is_driven || flows.driving != 0;
    }
    // What drives pinned particles is known to the order of the step only.
    if (!is_driven) step.cap_energy(allowed);
    Real end_energy = 0;
    for (const SteppedBody* body : island.bodies) end_energy += body->elastic_energy + kinetic_energy(body->particles);
    const Real tolerance = is_driven ? energy_tolerance : growth_noise;
    const bool gives_up = !is_separated && !surfaces.are_near && !surfaces.may_be_near;
    return Attempt{.substeps = gives_up ? most_implicit_substeps : substeps,
                   .energy = is_separated ? end_energy : std::numeric_limits<Real>::infinity(),
                   .allowed = allowed,
                   .noise = tolerance * (std::max(start_energy, end_energy) + start_rigid_energy) + energy_noise};
  };
  const GuardedStep step =
      guard_energy(1, start_energy, {.most_substeps = most_implicit_substeps, .factor = 2}, attempt, undo);
  const Real most_energy = std::max(start_energy, step.attempt.energy) + start_rigid_energy;
  const bool gains = step.attempt.energy - step.attempt.allowed > energy_tolerance * most_energy + energy_noise;
  if (step.finite ? gains : !is_separated) {
    undo();
    return false;
  }
  report_particle_contacts(island);
  if (island.surface_scratch) island.surface_scratch->num_touching = 0;
  if (surfaces.are_near) surfaces.report();
  find_records(island);
  for (SteppedBody* body : island.bodies) {
    body->report.substeps = step.attempt.substeps;
    body->report.retries = step.retries;
    body->report.finite = step.finite;
  }
  if (step.finite) {
    book_losses(island, contact_loss);
  } else {
    island.records.clear();
    name_bad_particles(island.bodies);
    undo();
    for (SteppedBody* body : island.bodies) {
      body->step_flows = {};
      body->implicit.has_acceleration = false;
    }
  }
  give_back(island, duration);
  for (SteppedBody* body : island.bodies) end_step(*body, step.finite ? duration : 0);
  return true;
}

}  // namespace penalty
