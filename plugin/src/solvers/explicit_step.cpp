#include "penalty/solvers/explicit_step.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"
#include "penalty/solvers/stable_step.h"

namespace penalty {
namespace {

constexpr int most_damping_blocks = 8;
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

// One attempt at a step of an island.
class Attempt {
 public:
  Attempt(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration)
      : bodies_(bodies), rigid_bodies_(rigid_bodies), duration_(duration) {
    for (SteppedBody* body : bodies_) {
      has_contacts_ = has_contacts_ || !body->contacts.empty();
      has_damping_ = has_damping_ || body->options.damping_time > 0;
      for (int i = 0; i < body->particles.size(); ++i)
        if (body->particles.inverse_masses[i] == 0 && !body->particles.velocities.col(i).isZero(0))
          has_driven_particles_ = true;
    }
  }

  void run(int substeps) {
    const int blocks = has_damping_ ? std::clamp(substeps / 4, 1, most_damping_blocks) : 1;
    const int per_block = (substeps + blocks - 1) / blocks;
    const Real h = duration_ / (blocks * per_block);
    outside_work_ = 0;
    for (int block = 0; block < blocks; ++block) {
      Real kick_time = h / 2;
      for (int k = 0; k < per_block; ++k) {
        substep(kick_time, h);
        kick_time = h;
      }
      for (SteppedBody* body : bodies_) kick(*body, h / 2);
      for (RigidBody& body : rigid_bodies_) body.velocity += h / 2 * body.acceleration;
      for (SteppedBody* body : bodies_)
        if (body->options.damping_time > 0)
          body->potential->dissipate(body->particles.positions, body->particles.inverse_masses,
                                     body->options.damping_time, duration_ / blocks, body->particles.velocities);
    }
    substeps_ = blocks * per_block;
  }

  int substeps() const { return substeps_; }
  Real outside_work() const { return outside_work_; }  // of obstacles and driven particles [J]

 private:
  void substep(Real kick_time, Real h) {
    for (RigidBody& body : rigid_bodies_) body.velocity += kick_time * body.acceleration;
    if (has_contacts_) {
      for (SteppedBody* body : bodies_) kick(*body, kick_time);
      for (SteppedBody* body : bodies_)
        outside_work_ += solve_contacts(body->contacts, body->particles, rigid_bodies_, h, body->options.contact_slop);
      for (SteppedBody* body : bodies_) drift(*body, h);
    } else {
      for (SteppedBody* body : bodies_) kick_and_drift(*body, kick_time, h);
    }
    for (RigidBody& body : rigid_bodies_) body.drift(h);
    if (has_driven_particles_) add_driven_work(h / 2);
    for (SteppedBody* body : bodies_) evaluate_forces(*body);
    if (has_driven_particles_) add_driven_work(h / 2);
  }

  void add_driven_work(Real time) {
    for (const SteppedBody* body : bodies_)
      for (int i = 0; i < body->particles.size(); ++i)
        if (body->particles.inverse_masses[i] == 0)
          outside_work_ -= time * body->forces.col(i).dot(body->particles.velocities.col(i));
  }

  std::span<SteppedBody* const> bodies_;
  std::span<RigidBody> rigid_bodies_;
  Real duration_;
  bool has_contacts_ = false, has_damping_ = false, has_driven_particles_ = false;
  int substeps_ = 0;
  Real outside_work_ = 0;
};

// Kinetic + elastic energy of an island.
Real energy(std::span<SteppedBody* const> bodies, std::span<const RigidBody> rigid_bodies) {
  Real sum = 0;
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
  for (const SteppedBody* body : bodies) {
    Vector3 mass_displacement = Vector3::Zero();
    for (int i = 0; i < body->particles.size(); ++i) {
      if (body->particles.inverse_masses[i] == 0) continue;
      const Vector3 dx = (body->particles.positions.col(i) - body->start.positions.col(i)).head<3>();
      mass_displacement += dx / body->particles.inverse_masses[i];
      if (body->external_forces.size() != 0) work += body->external_forces.col(i).head<3>().dot(dx);
    }
    work += body->gravity.dot(mass_displacement);
  }
  for (std::size_t k = 0; k < rigid_bodies.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      work += inverse_or_zero(rigid_bodies[k].inverse_mass[axis]) * rigid_bodies[k].acceleration[axis] *
              (rigid_bodies[k].position[axis] - rigid_start[k].position[axis]);
  return work;
}

int wanted_substeps(std::span<SteppedBody* const> bodies, Real duration) {
  int substeps = 1;
  for (const SteppedBody* body : bodies) {
    int wanted = body->options.substeps;
    if (wanted == 0) {
      const Real safety = body->contacts.empty() ? body->options.safety : body->options.contact_safety;
      const Real limit = duration * std::sqrt(body->largest_eigenvalue) / 2 / safety;
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

void undo(std::span<SteppedBody* const> bodies) {
  for (SteppedBody* body : bodies) {
    body->particles.positions = body->start.positions;
    body->particles.velocities = body->start.velocities;
    for (Contact& contact : body->contacts) contact.depth = 0;
    evaluate_forces(*body);
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

void advance(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration) {
  if (bodies.empty() || !(duration > 0)) return;
  std::vector<RigidBody>& rigid_start = bodies.front()->rigid_start;
  rigid_start.assign(rigid_bodies.begin(), rigid_bodies.end());
  Real noise = 0, tolerance = std::numeric_limits<Real>::infinity();
  int max_substeps = 1;
  for (SteppedBody* body : bodies) {
    body->start.positions = body->particles.positions;
    body->start.velocities = body->particles.velocities;
    if (!body->forces_valid) evaluate_forces(*body);
    body->report = {};
    body->report.num_contacts = static_cast<int>(body->contacts.size());
    noise += body->energy_noise;
    tolerance = std::min(tolerance, body->options.energy_tolerance);
    max_substeps = std::max(max_substeps, body->options.max_substeps);
  }
  const Real start_energy = energy(bodies, rigid_bodies);
  const Real contact_noise = contact_noise_rate(bodies, rigid_bodies, duration) * duration;

  Attempt attempt(bodies, rigid_bodies, duration);
  int substeps = wanted_substeps(bodies, duration);
  int retries = 0;
  Real last_growth = std::numeric_limits<Real>::infinity();
  bool finite = true;
  for (;; ++retries) {
    attempt.run(substeps);
    const Real end_energy = energy(bodies, rigid_bodies);
    finite = std::isfinite(end_energy);
    const Real growth = end_energy - start_energy - attempt.outside_work() -
                        constant_force_work(bodies, rigid_bodies, rigid_start);
    const Real scale = std::max(start_energy, end_energy);
    if (finite && !(growth > tolerance * scale + noise + contact_noise / attempt.substeps())) break;
    if (finite && growth > unresponsive * last_growth && growth < doubtful_growth * scale) break;
    if (attempt.substeps() >= max_substeps || !std::isfinite(start_energy)) break;
    last_growth = finite ? growth : std::numeric_limits<Real>::infinity();
    substeps = std::min(static_cast<int>(retry_growth * attempt.substeps()) + 1, max_substeps);
    undo(bodies);
    std::copy(rigid_start.begin(), rigid_start.end(), rigid_bodies.begin());
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
    undo(bodies);
    std::copy(rigid_start.begin(), rigid_start.end(), rigid_bodies.begin());
    energy(bodies, rigid_bodies);
    return;
  }
  for (SteppedBody* body : bodies)
    if (body->options.drag > 0) {
      body->particles.velocities *= std::exp(-body->options.drag * duration);
      body->report.kinetic_energy = kinetic_energy(body->particles);
    }
}

}  // namespace penalty
