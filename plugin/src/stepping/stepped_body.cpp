#include "stepped_body.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "penalty/stepping/stable_step.h"

namespace penalty {
namespace {

int first_not_finite(const Particles& particles) {
  for (int i = 0; i < particles.size(); ++i)
    if (!particles.positions.col(i).allFinite() || !particles.velocities.col(i).allFinite()) return i;
  return -1;
}

int fastest(const Particles& particles) {
  Eigen::Index particle = -1;
  if (particles.size() > 0) particles.velocities.cwiseAbs().colwise().maxCoeff().maxCoeff(&particle);
  return static_cast<int>(particle);
}

void reset_forces(SteppedBody& body) {
  if (body.external_forces.size() == 0)
    body.forces.setZero(4, body.particles.size());
  else
    body.forces = body.external_forces;
}

}  // namespace

void evaluate_forces(SteppedBody& body) {
  reset_forces(body);
  body.elastic_energy = body.field->add_forces(body.particles.positions, body.forces);
  body.forces_valid = true;
}

void evaluate_forces_only(SteppedBody& body) {
  reset_forces(body);
  body.field->add_forces_only(body.particles.positions, body.forces);
  body.forces_valid = true;
}

Real kick_work(const SteppedBody& body, int particle, const Vector3& impulse, Real kick_time) {
  const Real inverse_mass = body.particles.inverse_masses[particle];
  if (!(inverse_mass > 0)) return 0;
  return kick_time / 2 * impulse.dot(inverse_mass * body.forces.col(particle).head<3>() + body.gravity);
}

Real begin_step(SteppedBody& body, bool may_unfold) {
  body.report = {};
  ++body.num_steps;
  body.report.unfolded =
      may_unfold && body.options.unfold &&
      unfold(body.particles.positions, body.field->rest_positions(), body.rest_span, body.particles.inverse_masses);
  if (body.report.unfolded) body.positions_changed();
  if (body.field->choose_phase(body.particles.positions) != 0) body.positions_changed();
  body.start.positions = body.particles.positions;
  body.start.velocities = body.particles.velocities;
  body.field->get_state(body.start_state);
  if (!body.forces_valid) evaluate_forces(body);
  body.step_flows = {};
  const Real energy = body.elastic_energy + kinetic_energy(body.particles);
  if (body.last_energy && std::isfinite(energy - *body.last_energy)) body.flows.changes += energy - *body.last_energy;
  body.last_energy = energy;
  return energy;
}

void undo_step(SteppedBody& body) {
  body.particles.positions = body.start.positions;
  body.particles.velocities = body.start.velocities;
  body.field->set_state(body.start_state);
  evaluate_forces(body);
}

void end_step(SteppedBody& body, Real duration) {
  StepReport& report = body.report;
  report.elastic_energy = body.elastic_energy;
  report.kinetic_energy = kinetic_energy(body.particles);
  if (body.options.drag > 0) {
    body.particles.velocities *= std::exp(-body.options.drag * duration);
    const Real before = report.kinetic_energy;
    report.kinetic_energy = kinetic_energy(body.particles);
    body.step_flows.drag += before - report.kinetic_energy;
  }
  body.last_energy = report.elastic_energy + report.kinetic_energy;
  body.flows += body.step_flows;
}

Real constant_force_work(const SteppedBody& body) {
  Vector3 mass_displacement = Vector3::Zero();
  Real external_work = 0;
  for (int i = 0; i < body.particles.size(); ++i) {
    if (body.particles.inverse_masses[i] == 0) continue;
    const Vector3 dx = (body.particles.positions.col(i) - body.start.positions.col(i)).head<3>();
    mass_displacement += dx / body.particles.inverse_masses[i];
    if (body.external_forces.size() != 0) external_work += body.external_forces.col(i).head<3>().dot(dx);
  }
  return body.gravity.dot(mass_displacement) + external_work;
}

Real energy(const Island& island) {
  Real sum = 0;
  for (const Coupling* coupling : island.couplings) sum += coupling->elastic_energy;
  for (const SteppedBody* body : island.bodies) sum += body->elastic_energy + kinetic_energy(body->particles);
  for (const RigidBody& body : island.rigid_bodies) sum += kinetic_energy(body);
  return sum;
}

Real constant_force_work(Island& island) {
  Real work = 0;
  for (SteppedBody* body : island.bodies) {
    body->step_flows.constant_forces = constant_force_work(*body);
    work += body->step_flows.constant_forces;
  }
  for (std::size_t k = 0; k < island.rigid_bodies.size(); ++k)
    work += work_of_accelerations(island.rigid_bodies[k], island.rigid_start[k]);
  return work;
}

void name_bad_particles(std::span<SteppedBody* const> bodies) {
  bool named = false;
  for (SteppedBody* body : bodies) {
    body->report.first_bad_particle = first_not_finite(body->start);
    named = named || body->report.first_bad_particle >= 0;
  }
  if (named) return;
  for (SteppedBody* body : bodies) body->report.first_bad_particle = fastest(body->start);
}

void estimate_stability(SteppedBody& body) {
  const PackedVectors& rest = body.field->rest_positions();
  const System stiffness = taut_stiffness(*body.field, rest);
  body.largest_eigenvalue = largest_eigenvalue_bound(stiffness, body.particles.inverse_masses);
  body.mass = 0;
  for (const Real inverse_mass : body.particles.inverse_masses) body.mass += inverse_or_zero(inverse_mass);
  const auto points = rest.topRows<3>();
  const Real extent2 =
      points.cols() == 0 ? 0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).squaredNorm();
  body.rest_span = affine_span(rest);
  body.damper.forget();
  body.size = std::sqrt(extent2);
  body.energy_noise = 1e-15 * body.mass * body.largest_eigenvalue * extent2;
  if (body.mass > 0) return;
  // Held altogether it has no mass to go by, but round-off in how it is driven, too.
  const std::vector<Real> ones(body.particles.inverse_masses.size(), 1);
  body.energy_noise = 1e-15 * largest_eigenvalue_bound(stiffness, ones) * extent2;
}

}  // namespace penalty
