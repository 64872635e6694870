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

}  // namespace

void advance_implicitly(Island& island, ImplicitSurfaces* surfaces, Real duration) {
  SteppedBody& body = *island.bodies.front();
  island.rigid_start = island.rigid_bodies;
  const Real start_energy = begin_step(body);
  body.implicit.contacts_at_start = body.implicit.contacts;
  StepReport& report = body.report;
  report.integrator = Integrator::implicit_step;
  EnergyFlows& flows = body.step_flows;
  RigidContacts rigid_contacts(island);
  const auto rigid_energy = [&island] {
    Real sum = 0;
    for (const RigidBody& rigid : island.rigid_bodies) sum += kinetic_energy(rigid);
    return sum;
  };
  const Real start_rigid_energy = rigid_energy();
  const auto undo = [&] {
    undo_step(body);
    island.rigid_bodies = island.rigid_start;
    body.implicit.newton.forget_stiffness();
    body.implicit.contacts = body.implicit.contacts_at_start;
    if (surfaces) surfaces->undo();
  };
  Real outside_work = 0, rigid_work = 0;  // by contacts
  const auto attempt = [&](int substeps) {
    flows = {};
    for (Contact& contact : island.contacts) contact.given = {};
    rigid_contacts.begin_attempt();
    if (island.surface_scratch) island.surface_scratch->records.clear();
    BackwardEuler step(island, surfaces, duration / substeps);
    bool is_separated = true;
    for (int k = 0; k < substeps && is_separated; ++k) is_separated = step.run();
    flows.constant_forces = constant_force_work(body);
    outside_work = step.outside_work();
    rigid_work = rigid_energy() - start_rigid_energy;
    for (std::size_t k = 0; k < island.rigid_bodies.size(); ++k)
      rigid_work -= work_of_accelerations(island.rigid_bodies[k], island.rigid_start[k]);
    // What contacts and damping take is not asked for: of a body that turns on its way, the latter is not what its work is.
    const Real allowed =
        start_energy + flows.received() - flows.contacts + outside_work - rigid_work - (flows.lost() - flows.damping);
    // What drives pinned particles is known to the order of the step only.
    const bool is_driven = flows.driving != 0;
    if (!is_driven) step.cap_energy(allowed);
    const Real end_energy = body.elastic_energy + kinetic_energy(body.particles);
    const Real tolerance = is_driven ? body.options.energy_tolerance : growth_noise;
    return Attempt{.substeps = substeps,
                   .energy = is_separated ? end_energy : std::numeric_limits<Real>::infinity(),
                   .allowed = allowed,
                   .noise = tolerance * (std::max(start_energy, end_energy) + start_rigid_energy) + body.energy_noise};
  };
  const GuardedStep step =
      guard_energy(1, start_energy, {.most_substeps = most_implicit_substeps, .factor = 2}, attempt, undo);
  report.substeps = step.attempt.substeps;
  report.retries = step.retries;
  report.finite = step.finite;
  report_particle_contacts(island);
  if (island.surface_scratch) island.surface_scratch->num_touching = 0;
  if (surfaces) surfaces->report();
  find_records(island);
  if (step.finite) {
    flows.contact_loss = outside_work - rigid_work - flows.contacts;
    const Real missing = step.attempt.allowed - flows.contact_loss - step.attempt.energy;
    flows.damping = std::clamp<Real>(missing, 0, flows.damping);
    flows.integration = missing - flows.damping;
  } else {
    island.records.clear();
    name_bad_particles(island.bodies);
    undo();
    flows = {};
    body.implicit.has_acceleration = false;
  }
  give_back(island, duration);
  end_step(body, step.finite ? duration : 0);
}

}  // namespace penalty
