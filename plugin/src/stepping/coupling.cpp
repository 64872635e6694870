#include "coupling.h"

#include <algorithm>
#include <cmath>

#include "penalty/stepping/stable_step.h"
#include "stepped_body.h"

namespace penalty {
namespace {

Vector3 arm_of(const Side& point, const Island& island) {
  return island.rigid_bodies[point.rigid].rotation * point.anchor;
}

// The points of a coupling where their bodies have them now.
void gather_positions(Coupling& coupling, const Island& island) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const Side& point = coupling.points[k];
    coupling.positions.col(static_cast<Eigen::Index>(k)).head<3>() =
        point.is_rigid() ? Vector3(island.rigid_bodies[point.rigid].position + arm_of(point, island))
                         : point.point.of(island.bodies[point.body]->particles.positions);
  }
}

// Gives an impulse to a point, books its work on the soft body and returns it.
Real push(const Side& point, const Vector3& impulse, Island& island) {
  if (!point.is_rigid()) {
    SteppedBody& body = *island.bodies[point.body];
    Particles& particles = body.particles;
    const Real mobility = point.point.mobility(particles.inverse_masses);
    if (!(mobility > 0)) return 0;
    Real work = mobility / 2 * impulse.squaredNorm();
    for (int k = 0; k < point.point.size; ++k) {
      const int i = point.point.particles[k];
      if (particles.inverse_masses[i] > 0)  // pinned ones hold their share
        work += point.point.weights[k] * impulse.dot(particles.velocities.col(i).head<3>());
    }
    body.step_flows.couplings += work;
    point.point.add_push(impulse, particles.inverse_masses, particles.velocities);
    return work;
  }
  RigidBody& body = island.rigid_bodies[point.rigid];
  if (!body.is_dynamic()) return 0;
  return body.push(impulse, arm_of(point, island));
}

// Of each point a mobility such that the matrix of all of them, which couples points that share particles or a rigid
// body, is nowhere more than the diagonal of these. All points of one rigid body may pull in the same direction at
// once.
Real mobility_bound(const Side& point, const Coupling& coupling, const Island& island) {
  if (point.is_rigid()) {
    const RigidBody& body = island.rigid_bodies[point.rigid];
    const auto count = std::count_if(coupling.points.begin(), coupling.points.end(),
                                     [&](const Side& other) { return other.is_rigid() && other.rigid == point.rigid; });
    return static_cast<Real>(count) * body.mobility_bound(point.anchor.norm());
  }
  const std::vector<Real>& inverse_masses = island.bodies[point.body]->particles.inverse_masses;
  Real row_sum = 0;
  for (const Side& other : coupling.points) {
    if (other.body != point.body) continue;
    for (int i = 0; i < point.point.size; ++i)
      for (int j = 0; j < other.point.size; ++j)
        if (point.point.particles[i] == other.point.particles[j])
          row_sum +=
              std::abs(point.point.weights[i] * other.point.weights[j]) * inverse_masses[point.point.particles[i]];
  }
  return row_sum;
}

}  // namespace

void gather_velocities(Coupling& coupling, const Island& island) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const Side& point = coupling.points[k];
    coupling.velocities.col(static_cast<Eigen::Index>(k)).head<3>() =
        point.is_rigid() ? island.rigid_bodies[point.rigid].velocity_at(arm_of(point, island))
                         : point.point.of(island.bodies[point.body]->particles.velocities);
  }
}

void evaluate_forces(Coupling& coupling, const Island& island) {
  gather_positions(coupling, island);
  coupling.forces.setZero();
  coupling.elastic_energy = coupling.field->add_forces(coupling.positions, coupling.forces);
}

void kick(const Coupling& coupling, Island& island, Real time) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const Side& point = coupling.points[k];
    const Vector3 impulse = time * coupling.forces.col(static_cast<Eigen::Index>(k)).head<3>();
    push(point, impulse, island);
    if (point.is_rigid()) continue;
    SteppedBody& body = *island.bodies[point.body];
    for (int i = 0; i < point.point.size; ++i)
      body.step_flows.couplings += point.point.weights[i] * kick_work(body, point.point.particles[i], impulse, time);
  }
}

Real dissipate(Coupling& coupling, Island& island, Real duration) {
  gather_positions(coupling, island);
  gather_velocities(coupling, island);
  coupling.previous_velocities = coupling.velocities;
  coupling.field->dissipate(coupling.positions, coupling.inverse_masses, coupling.damping_time, duration,
                            coupling.velocities);
  Real work = 0;
  bool driven = false;
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (coupling.inverse_masses[k] > 0)
      work +=
          push(coupling.points[k],
               (coupling.velocities - coupling.previous_velocities).col(column).head<3>() / coupling.inverse_masses[k],
               island);
    else
      driven = driven || !coupling.velocities.col(column).isZero(0);
  }
  return driven ? work : 0;
}

void estimate_stability(Coupling& coupling, const Island& island, bool anew) {
  const auto size = static_cast<Eigen::Index>(coupling.points.size());
  anew = anew || coupling.positions.cols() != size;
  coupling.positions.setZero(4, size);
  coupling.velocities.setZero(4, size);
  coupling.previous_velocities.setZero(4, size);
  coupling.forces.setZero(4, size);
  std::vector<Real> inverse_masses(coupling.points.size());
  for (std::size_t k = 0; k < inverse_masses.size(); ++k)
    inverse_masses[k] = mobility_bound(coupling.points[k], coupling, island);
  // The norm of the inertia changes in its last digits as the body turns.
  for (std::size_t k = 0; k < inverse_masses.size() && !anew; ++k)
    anew = std::abs(inverse_masses[k] - coupling.inverse_masses[k]) > 1e-6 * inverse_masses[k];
  coupling.inverse_masses = std::move(inverse_masses);
  coupling.has_driven_points = std::count(coupling.inverse_masses.begin(), coupling.inverse_masses.end(), 0) > 0;
  if (anew)
    coupling.largest_eigenvalue =
        gershgorin_bound(taut_stiffness(*coupling.field, coupling.field->rest_positions()), coupling.inverse_masses);
}

}  // namespace penalty
