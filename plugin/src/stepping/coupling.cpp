#include "coupling.h"

#include <algorithm>
#include <cmath>

#include "penalty/stepping/stable_step.h"
#include "stepped_body.h"

namespace penalty {
namespace {

Vector3 arm_of(const CoupledPoint& point, std::span<const RigidBody> rigid_bodies) {
  return rigid_bodies[point.rigid_body].rotation * point.anchor;
}

// The points of a coupling where their bodies have them now.
void gather_positions(Coupling& coupling, std::span<SteppedBody* const> bodies,
                      std::span<const RigidBody> rigid_bodies) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    const auto column = static_cast<Eigen::Index>(k);
    if (point.body >= 0)
      coupling.positions.col(column) = bodies[point.body]->particles.positions.col(point.particle);
    else
      coupling.positions.col(column).head<3>() = rigid_bodies[point.rigid_body].position + arm_of(point, rigid_bodies);
  }
}

// Gives an impulse to a point, books its work on the soft body and returns it.
Real push(const CoupledPoint& point, const Vector3& impulse, std::span<SteppedBody* const> bodies,
          std::span<RigidBody> rigid_bodies) {
  if (point.body >= 0) {
    SteppedBody& body = *bodies[point.body];
    const Real inverse_mass = body.particles.inverse_masses[point.particle];
    auto velocity = body.particles.velocities.col(point.particle).head<3>();
    if (!(inverse_mass > 0)) return 0;
    const Real work = impulse.dot(velocity) + inverse_mass / 2 * impulse.squaredNorm();
    body.step_flows.couplings += work;
    velocity += inverse_mass * impulse;
    return work;
  }
  RigidBody& body = rigid_bodies[point.rigid_body];
  if (!body.is_dynamic()) return 0;
  const Vector3 moment = arm_of(point, rigid_bodies).cross(impulse);
  const Vector3 dv = body.inverse_mass.cwiseProduct(impulse), dw = body.inverse_inertia * moment;
  const Real work = impulse.dot(body.velocity + dv / 2) + moment.dot(body.angular_velocity + dw / 2);
  body.velocity += dv;
  body.angular_velocity += dw;
  body.impulse += impulse;
  body.angular_impulse += moment;
  return work;
}

}  // namespace

void gather_velocities(Coupling& coupling, std::span<SteppedBody* const> bodies,
                       std::span<const RigidBody> rigid_bodies) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    const auto column = static_cast<Eigen::Index>(k);
    if (point.body >= 0)
      coupling.velocities.col(column) = bodies[point.body]->particles.velocities.col(point.particle);
    else
      coupling.velocities.col(column).head<3>() =
          rigid_bodies[point.rigid_body].velocity_at(arm_of(point, rigid_bodies));
  }
}

void evaluate_forces(Coupling& coupling, std::span<SteppedBody* const> bodies,
                     std::span<const RigidBody> rigid_bodies) {
  gather_positions(coupling, bodies, rigid_bodies);
  coupling.forces.setZero();
  coupling.elastic_energy = coupling.potential->add_forces(coupling.positions, coupling.forces);
}

void kick(const Coupling& coupling, std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies,
          Real time) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    const Vector3 impulse = time * coupling.forces.col(static_cast<Eigen::Index>(k)).head<3>();
    push(point, impulse, bodies, rigid_bodies);
    if (point.body >= 0)
      bodies[point.body]->step_flows.couplings += kick_work(*bodies[point.body], point.particle, impulse, time);
  }
}

Real dissipate(Coupling& coupling, std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies,
               Real duration) {
  gather_positions(coupling, bodies, rigid_bodies);
  gather_velocities(coupling, bodies, rigid_bodies);
  coupling.previous_velocities = coupling.velocities;
  coupling.potential->dissipate(coupling.positions, coupling.inverse_masses, coupling.damping_time, duration,
                                coupling.velocities);
  Real work = 0;
  bool driven = false;
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (coupling.inverse_masses[k] > 0)
      work +=
          push(coupling.points[k],
               (coupling.velocities - coupling.previous_velocities).col(column).head<3>() / coupling.inverse_masses[k],
               bodies, rigid_bodies);
    else
      driven = driven || !coupling.velocities.col(column).isZero(0);
  }
  return driven ? work : 0;
}

void estimate_stability(Coupling& coupling, std::span<SteppedBody* const> bodies,
                        std::span<const RigidBody> rigid_bodies, const Positions& rest_positions, bool anew) {
  const auto size = static_cast<Eigen::Index>(coupling.points.size());
  anew = anew || coupling.positions.cols() != size;
  coupling.positions.setZero(4, size);
  coupling.velocities.setZero(4, size);
  coupling.previous_velocities.setZero(4, size);
  coupling.forces.setZero(4, size);
  coupling.inverse_masses.resize(coupling.points.size(), -1);
  std::vector<Real> points_on(rigid_bodies.size(), 0);
  for (const CoupledPoint& point : coupling.points)
    if (point.body < 0) ++points_on[point.rigid_body];
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    Real inverse_mass = 0;
    if (point.body >= 0) {
      inverse_mass = bodies[point.body]->particles.inverse_masses[point.particle];
    } else {
      // All points of one rigid body may pull in the same direction at once.
      const RigidBody& body = rigid_bodies[point.rigid_body];
      inverse_mass = points_on[point.rigid_body] *
                     (body.inverse_mass.maxCoeff() + body.inverse_inertia.norm() * point.anchor.squaredNorm());
    }
    // The norm of the inertia changes in its last digits as the body turns.
    anew = anew || std::abs(inverse_mass - coupling.inverse_masses[k]) > 1e-6 * inverse_mass;
    coupling.inverse_masses[k] = inverse_mass;
  }
  coupling.has_driven_points = std::count(coupling.inverse_masses.begin(), coupling.inverse_masses.end(), 0) > 0;
  if (anew)
    coupling.largest_eigenvalue = gershgorin_bound(*coupling.potential, rest_positions, coupling.inverse_masses);
}

}  // namespace penalty
