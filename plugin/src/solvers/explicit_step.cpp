#include "penalty/solvers/explicit_step.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"
#include "penalty/solvers/stable_step.h"

namespace penalty {
namespace {

constexpr int most_blocks = 8;            // of substeps, after each of which there is damping and plastic flow
constexpr Real retry_growth = 1.5;        // substeps of a repeated step
constexpr Real substep_memory = 0.8;      // share of the last step's substeps that the next one starts from
constexpr Real doubtful_growth = 0.2;     // relative growth of energy that is never taken for outside work
constexpr Real unresponsive = 0.8;        // growth that substeps do not reduce below this share is outside work

// v += time * (f / m + g); a pinned particle keeps its velocity.
void kick(SteppedBody& body, Real time) {
  const Real* f = body.forces.data();
  Real* v = body.particles.velocities.data();
  const Vector3 dv = time * body.gravity;
  for (const Real inverse_mass : body.particles.inverse_masses) {
    if (inverse_mass > 0) {
      const Real scale = time * inverse_mass;
      for (int axis = 0; axis < 3; ++axis) v[axis] += scale * f[axis] + dv[axis];
    }
    f += 4;
    v += 4;
  }
}

void drift(SteppedBody& body, Real time) { body.particles.positions += time * body.particles.velocities; }

// Kick and drift in one pass over the particles.
void kick_and_drift(SteppedBody& body, Real kick_time, Real drift_time) {
  const Real* f = body.forces.data();
  Real* v = body.particles.velocities.data();
  Real* x = body.particles.positions.data();
  const Vector3 dv = kick_time * body.gravity;
  for (const Real inverse_mass : body.particles.inverse_masses) {
    if (inverse_mass > 0) {
      const Real scale = kick_time * inverse_mass;
      for (int axis = 0; axis < 3; ++axis) v[axis] += scale * f[axis] + dv[axis];
    }
    for (int axis = 0; axis < 3; ++axis) x[axis] += drift_time * v[axis];
    f += 4;
    v += 4;
    x += 4;
  }
}

void evaluate_forces(SteppedBody& body) {
  if (body.external_forces.size() == 0)
    body.forces.setZero(4, body.particles.size());
  else
    body.forces = body.external_forces;
  body.elastic_energy = body.potential->add_forces(body.particles.positions, body.forces);
  body.forces_valid = true;
}

Real inverse_or_zero(Real value) { return value > 0 ? 1 / value : 0; }

Real kinetic_energy(const RigidBody& body) {
  Real twice = 0;
  for (int axis = 0; axis < 3; ++axis)
    twice += inverse_or_zero(body.inverse_mass[axis]) * body.velocity[axis] * body.velocity[axis];
  if (!body.inverse_inertia.isZero(0))  // angular factors may leave it singular
    twice += body.angular_velocity.dot(
        body.inverse_inertia.completeOrthogonalDecomposition().solve(body.angular_velocity));
  return twice / 2;
}

Vector3 arm_of(const CoupledPoint& point, std::span<const RigidBody> rigid_bodies) {
  return rigid_bodies[point.rigid_body].rotation * point.anchor;
}

// The points of a coupling where their bodies have them now.
void gather_positions(Coupling& coupling, std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    const auto column = static_cast<Eigen::Index>(k);
    if (point.body >= 0)
      coupling.positions.col(column) = bodies[point.body]->particles.positions.col(point.particle);
    else
      coupling.positions.col(column).head<3>() =
          rigid_bodies[point.rigid_body].position + arm_of(point, rigid_bodies);
  }
}

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

// Half the work that an impulse on a particle shares with the kick of the body's own forces.
Real kick_work(const SteppedBody& body, int particle, const Vector3& impulse, Real kick_time) {
  const Real inverse_mass = body.particles.inverse_masses[particle];
  if (!(inverse_mass > 0)) return 0;
  return kick_time / 2 * impulse.dot(inverse_mass * body.forces.col(particle).head<3>() + body.gravity);
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
  const Real work =
      impulse.dot(body.velocity + dv / 2) + moment.dot(body.angular_velocity + dw / 2);
  body.velocity += dv;
  body.angular_velocity += dw;
  body.impulse += impulse;
  body.angular_impulse += moment;
  return work;
}

void evaluate_forces(Coupling& coupling, std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies) {
  gather_positions(coupling, bodies, rigid_bodies);
  coupling.forces.setZero();
  coupling.elastic_energy = coupling.potential->add_forces(coupling.positions, coupling.forces);
}

// Comes before the other forces of the same kick: the work of each part is that at the mean of the velocities before and after
// the whole.
void kick(const Coupling& coupling, std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real time) {
  for (std::size_t k = 0; k < coupling.points.size(); ++k) {
    const CoupledPoint& point = coupling.points[k];
    const Vector3 impulse = time * coupling.forces.col(static_cast<Eigen::Index>(k)).head<3>();
    push(point, impulse, bodies, rigid_bodies);
    if (point.body >= 0) bodies[point.body]->step_flows.couplings += kick_work(*bodies[point.body], point.particle, impulse, time);
  }
}

// The velocities that `dissipate` makes of the points, as impulses on the bodies. The mobility that it reckons with is no
// smaller than the true one, so that energy falls. Returns the work of who drives points that nothing moves.
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
      work += push(
          coupling.points[k],
          (coupling.velocities - coupling.previous_velocities).col(column).head<3>() / coupling.inverse_masses[k],
          bodies, rigid_bodies);
    else
      driven = driven || !coupling.velocities.col(column).isZero(0);
  }
  return driven ? work : 0;
}

// One attempt at a step of an island.
class Attempt {
 public:
  Attempt(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, std::span<Coupling* const> couplings,
          Real duration)
      : bodies_(bodies), rigid_bodies_(rigid_bodies), couplings_(couplings), duration_(duration) {
    for (SteppedBody* body : bodies_) {
      has_contacts_ = has_contacts_ || !body->contacts.empty();
      has_blocks_ = has_blocks_ || damps(*body) || body->potential->evolves();
      for (int i = 0; i < body->particles.size(); ++i)
        if (body->particles.inverse_masses[i] == 0 && !body->particles.velocities.col(i).isZero(0))
          has_driven_particles_ = true;
    }
    for (Coupling* coupling : couplings_)
      has_blocks_ = has_blocks_ || damps(*coupling) || coupling->potential->evolves();
  }

  void run(int substeps) {
    const int blocks = has_blocks_ ? std::clamp(substeps / 4, 1, most_blocks) : 1;
    const int per_block = (substeps + blocks - 1) / blocks;
    const Real h = duration_ / (blocks * per_block);
    outside_work_ = 0;
    for (SteppedBody* body : bodies_) body->step_flows = {};
    for (int block = 0; block < blocks; ++block) {
      Real kick_time = h / 2;
      for (int k = 0; k < per_block; ++k) {
        substep(kick_time, h);
        kick_time = h;
      }
      kick_others(h / 2);
      for (SteppedBody* body : bodies_) kick(*body, h / 2);
      if (has_blocks_) end_block(duration_ / blocks);
    }
    substeps_ = blocks * per_block;
  }

  int substeps() const { return substeps_; }
  Real outside_work() const { return outside_work_; }  // of obstacles and driven particles [J]

 private:
  template <class Item>
  static bool damps(const Item& item) {
    if constexpr (requires { item.options; })
      return item.options.damping_time > 0 || item.potential->damps();
    else
      return item.damping_time > 0 || item.potential->damps();
  }

  void substep(Real kick_time, Real h) {
    kick_others(kick_time);
    if (has_contacts_) {
      for (SteppedBody* body : bodies_) kick(*body, kick_time);
      for (SteppedBody* body : bodies_) {
        const ContactWork work =
            solve_contacts(body->contacts, body->particles, rigid_bodies_, h, body->options.contact_slop);
        outside_work_ += work.obstacles;
        const Real shared = shared_with_kick(*body, h);
        body->step_flows.contacts += work.particles - shared;
        body->step_flows.contact_loss += work.loss + shared;
      }
      for (SteppedBody* body : bodies_) drift(*body, h);
    } else {
      for (SteppedBody* body : bodies_) kick_and_drift(*body, kick_time, h);
    }
    for (RigidBody& body : rigid_bodies_) body.drift(h);
    add_driving_work(h / 2);
    for (SteppedBody* body : bodies_) evaluate_forces(*body);
    for (Coupling* coupling : couplings_) evaluate_forces(*coupling, bodies_, rigid_bodies_);
    add_driving_work(h / 2);
  }

  // A kick and the contacts after it are one change of velocity, whose work is that of each part at the mean of the
  // velocities before and after. What the sweep takes for its own lies too far on the side of the kick: where a particle is
  // pressed against the ground and stays at rest, all of it. Since the last drift there was a whole kick, be it in halves.
  static Real shared_with_kick(const SteppedBody& body, Real h) {
    Real work = 0;
    for (const Contact& contact : body.contacts)
      if (!contact.impulse.isZero(0))
        for (int k = 0; k < contact.point.num_particles; ++k)
          work += contact.point.weights[k] * kick_work(body, contact.point.particles[k], contact.impulse, h);
    return work;
  }

  // Rigid bodies, by what acts on them, and everything that is coupled, by the couplings.
  void kick_others(Real time) {
    for (RigidBody& body : rigid_bodies_) body.velocity += time * body.acceleration;
    for (const Coupling* coupling : couplings_) kick(*coupling, bodies_, rigid_bodies_, time);
  }

  // Damping, plastic flow, breaking.
  void end_block(Real duration) {
    for (SteppedBody* body : bodies_) {
      if (damps(*body)) {
        const Real before = kinetic_energy(body->particles);
        body->potential->dissipate(body->particles.positions, body->particles.inverse_masses,
                                   body->options.damping_time, duration, body->particles.velocities);
        const Real lost = before - kinetic_energy(body->particles);
        body->step_flows.damping += lost;
        if (has_driven_particles_) outside_work_ -= lost;  // what drives them may give energy through the damping

      }
      if (body->potential->evolves()) {
        const Real taken = body->potential->evolve(body->particles.positions, duration);
        body->step_flows.inelastic += taken;
        if (taken != 0) evaluate_forces(*body);
      }
    }
    for (Coupling* coupling : couplings_) {
      if (damps(*coupling)) outside_work_ += dissipate(*coupling, bodies_, rigid_bodies_, duration);
      if (coupling->potential->evolves() && coupling->potential->evolve(coupling->positions, duration) != 0)
        evaluate_forces(*coupling, bodies_, rigid_bodies_);
    }
  }

  void add_driving_work(Real time) {
    if (has_driven_particles_)
      for (SteppedBody* body : bodies_)
        for (int i = 0; i < body->particles.size(); ++i)
          if (body->particles.inverse_masses[i] == 0) {
            const Real work = -time * body->forces.col(i).dot(body->particles.velocities.col(i));
            body->step_flows.driving += work;
            outside_work_ += work;
          }
    for (Coupling* coupling : couplings_) {
      if (!coupling->has_driven_points) continue;
      gather_velocities(*coupling, bodies_, rigid_bodies_);
      for (std::size_t k = 0; k < coupling->points.size(); ++k)
        if (coupling->inverse_masses[k] == 0)
          outside_work_ -= time * coupling->forces.col(static_cast<Eigen::Index>(k))
                                      .dot(coupling->velocities.col(static_cast<Eigen::Index>(k)));
    }
  }

  std::span<SteppedBody* const> bodies_;
  std::span<RigidBody> rigid_bodies_;
  std::span<Coupling* const> couplings_;
  Real duration_;
  bool has_contacts_ = false, has_blocks_ = false, has_driven_particles_ = false;
  int substeps_ = 0;
  Real outside_work_ = 0;
};

// Kinetic + elastic energy of an island.
Real energy(std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies,
            std::span<Coupling* const> couplings) {
  Real sum = 0;
  for (const Coupling* coupling : couplings) sum += coupling->elastic_energy;
  for (SteppedBody* body : bodies) {
    body->report.elastic_energy = body->elastic_energy;
    body->report.kinetic_energy = kinetic_energy(body->particles);
    sum += body->report.elastic_energy + body->report.kinetic_energy;
  }
  for (const RigidBody& body : rigid_bodies) sum += kinetic_energy(body);
  return sum;
}

// Work of gravity, external forces and accelerations since the start of the step.
Real constant_force_work(std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies,
                         std::span<const RigidBody> rigid_start) {
  Real work = 0;
  for (SteppedBody* body : bodies) {
    Vector3 mass_displacement = Vector3::Zero();
    Real external_work = 0;
    for (int i = 0; i < body->particles.size(); ++i) {
      if (body->particles.inverse_masses[i] == 0) continue;
      const Vector3 dx = (body->particles.positions.col(i) - body->start.positions.col(i)).head<3>();
      mass_displacement += dx / body->particles.inverse_masses[i];
      if (body->external_forces.size() != 0) external_work += body->external_forces.col(i).head<3>().dot(dx);
    }
    body->step_flows.constant_forces = body->gravity.dot(mass_displacement) + external_work;
    work += body->step_flows.constant_forces;
  }
  for (std::size_t k = 0; k < rigid_bodies.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      work += inverse_or_zero(rigid_bodies[k].inverse_mass[axis]) * rigid_bodies[k].acceleration[axis] *
              (rigid_bodies[k].position[axis] - rigid_start[k].position[axis]);
  return work;
}

int wanted_substeps(std::span<SteppedBody* const> bodies, std::span<Coupling* const> couplings, Real duration) {
  int substeps = 1;
  Real coupling_eigenvalue = 0;  // eigenvalues of a sum are no larger than the sum of the largest
  for (const Coupling* coupling : couplings) coupling_eigenvalue += coupling->largest_eigenvalue;
  for (const SteppedBody* body : bodies) {
    int wanted = body->options.substeps;
    if (wanted == 0) {
      const Real safety = body->contacts.empty() ? body->options.safety : body->options.contact_safety;
      const Real limit = duration * std::sqrt(body->largest_eigenvalue + coupling_eigenvalue) / 2 / safety;
      wanted = limit < body->options.max_substeps ? static_cast<int>(std::ceil(limit)) : body->options.max_substeps;
    }
    substeps = std::max({substeps, wanted, static_cast<int>(substep_memory * body->last_substeps)});
  }
  return substeps;
}

// What holds a body up against a constant acceleration a takes a h from it after each kick of a substep h: energy is then
// defined no better than the work over that speed, whatever the state. [J s], to be multiplied with h.
Real contact_noise_rate(std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies, Real duration) {
  Real rate = 0;
  for (const SteppedBody* body : bodies)
    if (!body->contacts.empty()) rate += body->mass * body->gravity.squaredNorm() * duration;
  for (const RigidBody& body : rigid_bodies)
    for (int axis = 0; axis < 3; ++axis)
      rate += inverse_or_zero(body.inverse_mass[axis]) * body.acceleration[axis] * body.acceleration[axis] * duration;
  return rate;
}

void undo(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies,
          std::span<const RigidBody> rigid_start, std::span<Coupling* const> couplings) {
  std::copy(rigid_start.begin(), rigid_start.end(), rigid_bodies.begin());
  for (SteppedBody* body : bodies) {
    body->particles.positions = body->start.positions;
    body->particles.velocities = body->start.velocities;
    for (Contact& contact : body->contacts) contact.depth = 0;
    body->potential->restore_state();
    evaluate_forces(*body);
  }
  for (Coupling* coupling : couplings) {
    coupling->potential->restore_state();
    evaluate_forces(*coupling, bodies, rigid_bodies);
  }
}

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

// Names the particle to look at after a step that could not be made finite, in the state that it started from: one that is
// not finite itself; if there is none in the island, the fastest of each body.
void name_bad_particles(std::span<SteppedBody* const> bodies) {
  bool named = false;
  for (SteppedBody* body : bodies) {
    body->report.first_bad_particle = first_not_finite(body->start);
    named = named || body->report.first_bad_particle >= 0;
  }
  if (named) return;
  for (SteppedBody* body : bodies) body->report.first_bad_particle = fastest(body->start);
}

}  // namespace

void StepOptions::check() const {
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string("step: ") + name + " is " + to_text(value) + ", must be " + range);
  };
  require(damping_time >= 0 && std::isfinite(damping_time), "damping_time", damping_time, "zero or positive [s]");
  require(drag >= 0 && std::isfinite(drag), "drag", drag, "zero or positive [1/s]");
  require(substeps >= 0, "substeps", substeps, "zero (automatic) or positive");
  require(safety > 0 && safety <= 1, "safety", safety, "in (0, 1]");
  require(contact_safety > 0 && contact_safety <= 1, "contact_safety", contact_safety, "in (0, 1]");
  require(energy_tolerance > 0, "energy_tolerance", energy_tolerance, "positive");
  require(max_substeps >= 1, "max_substeps", max_substeps, "at least 1");
  require(contact_slop >= 0 && std::isfinite(contact_slop), "contact_slop", contact_slop, "zero or positive [m]");
}

void estimate_stability(SteppedBody& body, const Positions& rest_positions) {
  body.largest_eigenvalue = largest_eigenvalue_bound(*body.potential, rest_positions, body.particles.inverse_masses);
  body.mass = 0;
  for (const Real inverse_mass : body.particles.inverse_masses) body.mass += inverse_or_zero(inverse_mass);
  const auto points = rest_positions.topRows<3>();
  const Real extent2 = points.cols() == 0 ? 0 : (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).squaredNorm();
  body.energy_noise = 1e-15 * body.mass * body.largest_eigenvalue * extent2;
}

EnergyFlows& EnergyFlows::operator+=(const EnergyFlows& other) {
  constant_forces += other.constant_forces;
  contacts += other.contacts;
  couplings += other.couplings;
  driving += other.driving;
  changes += other.changes;
  damping += other.damping;
  drag += other.drag;
  inelastic += other.inelastic;
  contact_loss += other.contact_loss;
  return *this;
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

void advance(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration,
             std::span<Coupling* const> couplings) {
  if (bodies.empty() || !(duration > 0)) return;
  std::vector<RigidBody>& rigid_start = bodies.front()->rigid_start;
  rigid_start.assign(rigid_bodies.begin(), rigid_bodies.end());
  Real noise = 0, tolerance = infinite;
  int max_substeps = 1;
  for (SteppedBody* body : bodies) {
    body->start.positions = body->particles.positions;
    body->start.velocities = body->particles.velocities;
    body->potential->save_state();
    if (!body->forces_valid) evaluate_forces(*body);
    body->report = {};
    body->report.num_contacts = static_cast<int>(body->contacts.size());
    noise += body->energy_noise;
    tolerance = std::min(tolerance, body->options.energy_tolerance);
    max_substeps = std::max(max_substeps, body->options.max_substeps);
  }
  for (Coupling* coupling : couplings) {
    coupling->potential->save_state();
    evaluate_forces(*coupling, bodies, rigid_bodies);
  }
  const Real start_energy = energy(bodies, rigid_bodies, couplings);
  for (SteppedBody* body : bodies) {
    const Real own = body->report.elastic_energy + body->report.kinetic_energy;
    if (body->stepped_before && std::isfinite(own - body->last_energy)) body->flows.changes += own - body->last_energy;
    body->last_energy = own;
    body->stepped_before = true;
  }
  const Real contact_noise = contact_noise_rate(bodies, rigid_bodies, duration) * duration;

  Attempt attempt(bodies, rigid_bodies, couplings, duration);
  int substeps = wanted_substeps(bodies, couplings, duration);
  int retries = 0;
  Real last_growth = infinite;
  bool finite = true;
  for (;; ++retries) {
    attempt.run(substeps);
    const Real end_energy = energy(bodies, rigid_bodies, couplings);
    finite = std::isfinite(end_energy);
    const Real growth = end_energy - start_energy - attempt.outside_work() -
                        constant_force_work(bodies, rigid_bodies, rigid_start);
    const Real scale = std::max(start_energy, end_energy);
    if (finite && !(growth > tolerance * scale + noise + contact_noise / attempt.substeps())) break;
    if (finite && growth > unresponsive * last_growth && growth < doubtful_growth * scale) break;
    if (attempt.substeps() >= max_substeps || !std::isfinite(start_energy)) break;
    last_growth = finite ? growth : infinite;
    substeps = std::min(static_cast<int>(retry_growth * attempt.substeps()) + 1, max_substeps);
    undo(bodies, rigid_bodies, rigid_start, couplings);
  }

  for (SteppedBody* body : bodies) {
    StepReport& report = body->report;
    report.substeps = attempt.substeps();
    report.retries = retries;
    report.finite = finite;
    body->last_substeps = attempt.substeps();
    for (const Contact& contact : body->contacts) report.contact_depth = std::max(report.contact_depth, contact.depth);
  }
  if (!finite) {
    name_bad_particles(bodies);
    undo(bodies, rigid_bodies, rigid_start, couplings);
    energy(bodies, rigid_bodies, couplings);
    return;
  }
  for (SteppedBody* body : bodies) {
    if (body->options.drag > 0) {
      body->particles.velocities *= std::exp(-body->options.drag * duration);
      const Real before = body->report.kinetic_energy;
      body->report.kinetic_energy = kinetic_energy(body->particles);
      body->step_flows.drag += before - body->report.kinetic_energy;
    }
    body->last_energy = body->report.elastic_energy + body->report.kinetic_energy;
    body->flows += body->step_flows;
  }
}

}  // namespace penalty
