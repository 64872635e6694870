#include "explicit_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "coupling.h"
#include "stepped_body.h"

namespace penalty {
namespace {

constexpr Real infinity = std::numeric_limits<Real>::infinity();
constexpr int most_blocks = 8;         // of substeps, after each of which there is damping and plastic flow
constexpr Real retry_growth = 1.5;     // substeps of a repeated step
constexpr Real substep_memory = 0.8;   // share of the last step's substeps that the next one starts from
constexpr Real doubtful_growth = 0.2;  // relative growth of energy that is never taken for outside work
constexpr Real unresponsive = 0.8;     // growth that substeps do not reduce below this share is outside work

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

// Both in one pass over the particles.
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
  for (const SteppedBody* body : bodies) sum += body->elastic_energy + kinetic_energy(body->particles);
  for (const RigidBody& body : rigid_bodies) sum += kinetic_energy(body);
  return sum;
}

// Work of gravity, external forces and accelerations since the start of the step.
Real constant_force_work(std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies,
                         std::span<const RigidBody> rigid_start) {
  Real work = 0;
  for (SteppedBody* body : bodies) {
    body->step_flows.constant_forces = constant_force_work(*body);
    work += body->step_flows.constant_forces;
  }
  for (std::size_t k = 0; k < rigid_bodies.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      work += inverse_or_zero(rigid_bodies[k].inverse_mass[axis]) * rigid_bodies[k].acceleration[axis] *
              (rigid_bodies[k].position[axis] - rigid_start[k].position[axis]);
  return work;
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
  for (SteppedBody* body : bodies) undo_step(*body);
  for (Coupling* coupling : couplings) {
    coupling->potential->restore_state();
    evaluate_forces(*coupling, bodies, rigid_bodies);
  }
}

}  // namespace

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

void advance_explicitly(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration,
                        std::span<Coupling* const> couplings) {
  std::vector<RigidBody>& rigid_start = bodies.front()->rigid_start;
  rigid_start.assign(rigid_bodies.begin(), rigid_bodies.end());
  Real noise = 0, tolerance = infinity;
  int max_substeps = 1;
  for (SteppedBody* body : bodies) {
    begin_step(*body);
    noise += body->energy_noise;
    tolerance = std::min(tolerance, body->options.energy_tolerance);
    max_substeps = std::max(max_substeps, body->options.max_substeps);
  }
  for (Coupling* coupling : couplings) {
    coupling->potential->save_state();
    evaluate_forces(*coupling, bodies, rigid_bodies);
  }
  const Real start_energy = energy(bodies, rigid_bodies, couplings);
  const Real contact_noise = contact_noise_rate(bodies, rigid_bodies, duration) * duration;

  Attempt attempt(bodies, rigid_bodies, couplings, duration);
  int substeps = wanted_substeps(bodies, couplings, duration);
  int retries = 0;
  Real last_growth = infinity;
  bool finite = true;
  for (;; ++retries) {
    attempt.run(substeps);
    const Real end_energy = energy(bodies, rigid_bodies, couplings);
    finite = std::isfinite(end_energy);
    const Real growth =
        end_energy - start_energy - attempt.outside_work() - constant_force_work(bodies, rigid_bodies, rigid_start);
    const Real scale = std::max(start_energy, end_energy);
    if (finite && !(growth > tolerance * scale + noise + contact_noise / attempt.substeps())) break;
    if (finite && growth > unresponsive * last_growth && growth < doubtful_growth * scale) break;
    if (attempt.substeps() >= max_substeps || !std::isfinite(start_energy)) break;
    last_growth = finite ? growth : infinity;
    substeps = std::min(static_cast<int>(retry_growth * attempt.substeps()) + 1, max_substeps);
    undo(bodies, rigid_bodies, rigid_start, couplings);
  }

  for (SteppedBody* body : bodies) {
    StepReport& report = body->report;
    report.substeps = attempt.substeps();
    body->implicit.has_acceleration = false;
    report.retries = retries;
    report.finite = finite;
    body->last_substeps = attempt.substeps();
    for (const Contact& contact : body->contacts) report.contact_depth = std::max(report.contact_depth, contact.depth);
  }
  if (!finite) {
    name_bad_particles(bodies);
    undo(bodies, rigid_bodies, rigid_start, couplings);
    for (SteppedBody* body : bodies) body->step_flows = {};
  }
  for (SteppedBody* body : bodies) end_step(*body, finite ? duration : 0);
}

}  // namespace penalty
