#include "explicit_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "anchors.h"
#include "coupling.h"
#include "energy_guard.h"
#include "joints.h"
#include "kick.h"
#include "particle_contacts.h"
#include "restitution.h"
#include "rigid_contacts.h"
#include "settling.h"
#include "stepped_body.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

constexpr int most_blocks = 8;             // of substeps, after each of which there is damping and plastic flow
constexpr int damped_blocks = 2;           // where bodies touch, of damping: an impact lasts no longer
constexpr Real retry_growth = 1.5;         // substeps of a repeated step
constexpr int most_island_sweeps = 50;     // of a substep; they end when one changes speeds by less than
constexpr Real rigid_tolerance = 1e-3;     // this share of the first, between rigid bodies,
constexpr Real particle_tolerance = 1e-2;  // this with soft ones,
constexpr Real negligible_change = 0.2;    // or of what accelerations make of them
constexpr int fewest_on_held = 8;          // substeps where a rigid body may lie on points that are held
constexpr Real substep_memory = 0.8;       // share of the last step's substeps that the next one starts from

bool damps(const SteppedBody& body) { return body.options.damping_time > 0 || body.field->damps(); }
bool damps(const Coupling& coupling) { return coupling.damping_time > 0 || coupling.field->damps(); }

/// The substeps of one step of an island.
class SubCycle {
 public:
  SubCycle(Island& island, SurfaceContacts& surfaces, Real duration)
      : island_(island),
        surfaces_(surfaces),
        rigid_contacts_(island),
        joints_(island),
        particle_contacts_(island),
        anchors_(island),
        duration_(duration) {
    are_coupled_ =
        !rigid_contacts_.is_empty() || !joints_.is_empty() || !anchors_.is_empty() || particle_contacts_.are_coupled();
    has_contacts_ = are_coupled_ || !particle_contacts_.is_empty() || !surfaces.is_empty();
    for (const SteppedBody* body : island_.bodies) {
      settles_ = settles_ || (has_contacts_ && body->options.settling_speed > 0 && !body->gravity.isZero(0));
      damps_ = damps_ || damps(*body);
      evolves_ = evolves_ || body->field->evolves();
      for (int i = 0; i < body->particles.size(); ++i)
        if (body->particles.inverse_masses[i] == 0 && !body->particles.velocities.col(i).isZero(0))
          has_driven_particles_ = true;
    }
    for (const Coupling* coupling : island_.couplings) {
      damps_ = damps_ || damps(*coupling);
      evolves_ = evolves_ || coupling->field->evolves();
    }
  }

  void run(int substeps) {
    const Real h = duration_ / substeps;
    outside_work_ = since_contacts_ = 0;
    for_each_constraint([](auto& constraints) { constraints.begin_attempt(); });
    remaining_ = duration_;
    for (SteppedBody* body : island_.bodies) {
      body->step_flows = {};
      body->report.damping_share = 1;
      body->damper.begin_step();
    }
    // Seen once in a half period and always at rest, a mode is not damped: the fewer substeps between, the fewer such.
    const int most = std::clamp(substeps / 4, 1, most_blocks),
              dampings = has_contacts_ ? std::min(damped_blocks, substeps) : most;
    const int flows = most, apart = std::max(substeps / 2, 1), settling_instant = moving_instant(apart);
    int flowed = 0;  // substeps before the last flow
    Real kick_time = h / 2;
    for (int k = 1; k <= substeps; ++k) {
      substep(kick_time, h, k == substeps);
      kick_time = h;
      const auto ends_one_of = [&](int parts) { return k * parts / substeps > (k - 1) * parts / substeps; };
      const bool damps_now = damps_ && ends_one_of(dampings);
      const bool settles_now = settles_ && (k == settling_instant || k == settling_instant + apart) && is_pressed();
      const bool flows_now = evolves_ && ends_one_of(flows);
      if (!damps_now && !settles_now && !flows_now && k < substeps) continue;
      kick_time = h / 2;
      kick_others(h / 2);
      for (SteppedBody* body : island_.bodies) kick(*body, h / 2);
      // Of a velocity that contacts have not seen there is nothing to damp, and nothing is handed out.
      if (has_contacts_)
        solve_contacts(0, h, [&] { surfaces_.close(h, since_contacts_, [this, h] { return sweep(h); }); });
      if (flows_now) evolve((k - std::exchange(flowed, k)) * h);
      if (damps_now) damp(duration_ / dampings);
      const bool has_settled = settles_now && settle(duration_ / std::min(substeps, 2));
      if (has_contacts_ && (damps_now || has_settled))
        solve_contacts(0, h, [&] { surfaces_.close_again(h, [this, h] { return sweep(h); }); });
    }
  }

  Real outside_work() const {
    return outside_work_ + rigid_contacts_.outside_work() + joints_.outside_work() + particle_contacts_.outside_work() +
           anchors_.outside_work();
  }  // of obstacles, of driven particles, of taking depth back [J]

  // Of a body by itself all is booked.
  bool may_have_unbooked_work() const { return has_contacts_ || has_driven_particles_ || !island_.couplings.empty(); }

 private:
  // What is met in the sweeps of a substep.
  template <class Call>
  void for_each_constraint(const Call& call) {
    call(rigid_contacts_);
    call(joints_);
    call(particle_contacts_);
    call(anchors_);
  }

  // The energy is read after the last one only.
  void substep(Real kick_time, Real h, bool is_last) {
    kick_others(kick_time);
    if (has_contacts_) {
      for (SteppedBody* body : island_.bodies) kick(*body, kick_time);
      // Since the last drift there was a whole kick, be it in halves.
      solve_contacts(h, h, [&] { surfaces_.sweep(h, remaining_, since_contacts_, [this, h] { return sweep(h); }); });
      for (SteppedBody* body : island_.bodies) drift(*body, h);
    } else {
      for (SteppedBody* body : island_.bodies) kick_and_drift(*body, kick_time, h);
    }
    for (RigidBody& body : island_.rigid_bodies) body.drift(h);
    surfaces_.drifted(h);
    remaining_ -= h;
    add_driving_work(h / 2);
    for (SteppedBody* body : island_.bodies) is_last ? evaluate_forces(*body) : evaluate_forces_only(*body);
    for (Coupling* coupling : island_.couplings) evaluate_forces(*coupling, island_);
    add_driving_work(h / 2);
  }

  // Once over the contacts with and between rigid bodies; returns whether that is to be done again.
  bool sweep(Real h) {
    const Real of_rigid = std::max(joints_.sweep(), rigid_contacts_.sweep()),
               of_particles = std::max(anchors_.sweep(), particle_contacts_.sweep());
    if (!are_coupled_) return false;
    const Real change = std::max(of_rigid, of_particles);
    if (sweeps_ == 0) first_change_ = change;
    return ++sweeps_ < most_island_sweeps && change > negligible_change * rigid_contacts_.acceleration() * h &&
           (of_rigid > rigid_tolerance * first_change_ || of_particles > particle_tolerance * first_change_);
  }

  // Books what contacts, by whatever sweeps, made of the velocities. A kick and the contacts after it are one change of
  // velocity, whose work is that of each part at the mean of the velocities before and after. What contacts change lies
  // too far on the side of the kick: where a particle is pressed against the ground and stays at rest, all of it.
  template <class Solve>
  void solve_contacts(Real kick_time, Real h, const Solve& solve) {
    for (SteppedBody* body : island_.bodies) body->before_contacts = body->particles.velocities;
    sweeps_ = 0;
    anchors_.begin(h);
    rigid_contacts_.begin(h, since_contacts_);
    joints_.begin(h, since_contacts_, kick_time > 0);  // no drift follows where no kick is counted
    particle_contacts_.begin(h, since_contacts_);
    anchors_.start(since_contacts_);
    solve();
    for_each_constraint([this](auto& constraints) { constraints.end(since_contacts_); });
    since_contacts_ = 0;
    for (SteppedBody* body : island_.bodies) {
      const Particles& particles = body->particles;
      Real work = 0, shared = 0;
      for (int i = 0; i < particles.size(); ++i) {
        const Real mass = inverse_or_zero(particles.inverse_masses[i]);
        if (mass == 0) continue;
        const Vector3 before = body->before_contacts.col(i).head<3>();
        const Vector3 change = particles.velocities.col(i).head<3>() - before;
        if (change.isZero(0)) continue;
        work += mass * change.dot(before + change / 2);
        shared += kick_work(*body, i, mass * change, kick_time);
      }
      body->step_flows.contacts += work - shared;
      body->step_flows.contact_loss += shared;
    }
  }

  // Rigid bodies, by what acts on them, and everything that is coupled, by the couplings.
  void kick_others(Real time) {
    since_contacts_ += time;
    for (RigidBody& body : island_.rigid_bodies) body.kick(time);
    for (const Coupling* coupling : island_.couplings) kick(*coupling, island_, time);
  }

  // Plastic flow and breaking.
  void evolve(Real duration) {
    for (SteppedBody* body : island_.bodies) {
      if (!body->field->evolves()) continue;
      const Real taken = body->field->evolve(body->particles.positions, duration);
      body->step_flows.inelastic += taken;
      if (taken != 0) evaluate_forces(*body);
    }
    for (Coupling* coupling : island_.couplings)
      if (coupling->field->evolves() && coupling->field->evolve(coupling->positions, duration) != 0)
        evaluate_forces(*coupling, island_);
  }

  // After this substep what lies is settled, in each step after another, as a mode may be at rest whenever it is damped.
  int moving_instant(int substeps) const {
    const Real turns = std::numbers::phi * island_.bodies.front()->num_steps;
    return 1 + static_cast<int>((turns - std::floor(turns)) * substeps);
  }

  bool is_pressed() const {
    return surfaces_.has_given() || std::any_of(island_.contacts.begin(), island_.contacts.end(),
                                                [](const Contact& contact) { return !contact.given.is_none(); });
  }

  bool settle(Real duration) {
    find_records(island_);
    return penalty::settle(island_, duration);
  }

  void damp(Real duration) {
    for (SteppedBody* body : island_.bodies) {
      if (!damps(*body)) continue;
      const Damper::Damped damped =
          body->damper.damp(*body->field, body->options.damping_time, duration, body->particles);
      body->step_flows.damping += damped.lost;
      body->step_flows.driving += damped.driving_work;
      body->report.damping_share = std::min(body->report.damping_share, damped.share);
      outside_work_ += damped.driving_work;
    }
    for (Coupling* coupling : island_.couplings)
      if (damps(*coupling)) outside_work_ += dissipate(*coupling, island_, duration);
  }

  void add_driving_work(Real time) {
    if (has_driven_particles_)
      for (SteppedBody* body : island_.bodies)
        for (int i = 0; i < body->particles.size(); ++i)
          if (body->particles.inverse_masses[i] == 0) {
            const Real work = -time * body->forces.col(i).dot(body->particles.velocities.col(i));
            body->step_flows.driving += work;
            outside_work_ += work;
          }
    for (Coupling* coupling : island_.couplings) {
      if (!coupling->has_driven_points) continue;
      gather_velocities(*coupling, island_);
      for (std::size_t k = 0; k < coupling->points.size(); ++k)
        if (coupling->inverse_masses[k] == 0)
          outside_work_ -= time * coupling->forces.col(static_cast<Eigen::Index>(k))
                                      .dot(coupling->velocities.col(static_cast<Eigen::Index>(k)));
    }
  }

  Island& island_;
  SurfaceContacts& surfaces_;
  RigidContacts rigid_contacts_;
  Joints joints_;
  ParticleContacts particle_contacts_;
  Anchors anchors_;
  Real duration_, remaining_ = 0;
  Real since_contacts_ = 0;  // time of the kicks since contacts were solved [s]
  Real first_change_ = 0;    // of a normal speed by the first sweep [m/s]
  int sweeps_ = 0;
  bool has_contacts_ = false, are_coupled_ = false, damps_ = false, settles_ = false, evolves_ = false;
  bool has_driven_particles_ = false;
  Real outside_work_ = 0;
};

void find_touching(Island& island, const SurfaceContacts& surfaces) {
  island.touching.resize(island.bodies.size());
  for (std::size_t k = 0; k < island.bodies.size(); ++k) island.touching[k] = surfaces.may_touch(k);
  for (const Contact& contact : island.contacts)
    for (const Side* side : {&contact.a, &contact.b})
      if (!side->is_rigid()) island.touching[side->body] = true;
  for (const Anchor& anchor : island.anchors) island.touching[anchor.a.body] = true;
}

// What holds a body up against a constant acceleration a takes a h from it after each kick of a substep h: energy is
// then defined no better than the work over that speed, whatever the state. [J s], to be multiplied with h.
Real contact_noise_rate(const Island& island, Real duration) {
  Real rate = 0;
  for (std::size_t k = 0; k < island.bodies.size(); ++k)
    if (island.touching[k]) rate += island.bodies[k]->mass * island.bodies[k]->gravity.squaredNorm() * duration;
  for (const RigidBody& body : island.rigid_bodies)
    for (int axis = 0; axis < 3; ++axis)
      rate += inverse_or_zero(body.inverse_mass[axis]) * body.acceleration[axis] * body.acceleration[axis] * duration;
  return rate;
}

void undo(Island& island, SurfaceContacts& surfaces) {
  island.rigid_bodies = island.rigid_start;
  for (SteppedBody* body : island.bodies) undo_step(*body);
  for (Coupling* coupling : island.couplings) {
    coupling->field->set_state(coupling->start_state);
    evaluate_forces(*coupling, island);
  }
  if (!surfaces.is_empty()) surfaces.undo();
}

int wanted_substeps(const Island& island, const SurfaceContacts& surfaces, Real duration) {
  int substeps = std::max(surfaces.least_substeps(), Joints::least_substeps(island, duration));
  // It ends a step half a substep's fall too fast, whatever holds it.
  if (std::any_of(island.contacts.begin(), island.contacts.end(), [&](const Contact& contact) {
        const std::vector<Real>& inverse_masses = island.bodies[contact.a.body]->particles.inverse_masses;
        return contact.b.is_rigid() && island.rigid_bodies[contact.b.rigid].is_dynamic() &&
               contact.a.point.mobility(inverse_masses) <= 0;
      }))
    substeps = std::max(substeps, fewest_on_held);
  Real coupling_eigenvalue = 0;  // eigenvalues of a sum are no larger than the sum of the largest
  for (const Coupling* coupling : island.couplings) coupling_eigenvalue += coupling->largest_eigenvalue;
  for (std::size_t k = 0; k < island.bodies.size(); ++k) {
    const SteppedBody& body = *island.bodies[k];
    int wanted = body.options.substeps;
    if (wanted == 0) {
      const Real share = island.touching[k] ? body.options.contact_safety : body.options.safety;
      const Real limit = duration * std::sqrt(body.largest_eigenvalue + coupling_eigenvalue) / 2 / share;
      wanted = limit < body.options.max_substeps ? static_cast<int>(std::ceil(limit)) : body.options.max_substeps;
    }
    substeps = std::max({substeps, wanted, static_cast<int>(substep_memory * body.last_substeps)});
  }
  return substeps;
}

}  // namespace

void advance_explicitly(Island& island, Real duration) {
  island.rigid_start = island.rigid_bodies;
  Real noise = 0, tolerance = std::numeric_limits<Real>::infinity();
  int most_substeps = 1;
  // Pressed flat between others, a body would be unfolded through them.
  const bool may_unfold =
      std::all_of(island.surfaces.begin(), island.surfaces.end(),
                  [](const SurfaceContact& contact) { return contact.is_within_body() || contact.rigid >= 0; });
  for (SteppedBody* body : island.bodies) {
    begin_step(*body, may_unfold);
    noise += body->energy_noise;
    tolerance = std::min(tolerance, body->options.energy_tolerance);
    most_substeps = std::max(most_substeps, body->options.max_substeps);
  }
  for (Coupling* coupling : island.couplings) {
    coupling->field->get_state(coupling->start_state);
    evaluate_forces(*coupling, island);
  }
  const Real start_energy = energy(island);
  SurfaceContacts surfaces(island);
  surfaces.begin_step(duration);
  find_touching(island, surfaces);
  const Real contact_noise = contact_noise_rate(island, duration) * duration;

  SubCycle cycle(island, surfaces, duration);
  const auto attempt = [&](int substeps) {
    cycle.run(substeps);
    const Real end_energy = energy(island);
    return Attempt{
        .substeps = substeps,
        .energy = end_energy,
        .allowed = start_energy + cycle.outside_work() + surfaces.outside_work() + constant_force_work(island),
        .noise = tolerance * std::max(start_energy, end_energy) + noise + contact_noise / substeps};
  };
  const GuardedStep step = guard_energy(wanted_substeps(island, surfaces, duration), start_energy,
                                        {.most_substeps = most_substeps,
                                         .factor = retry_growth,
                                         .increment = 1,
                                         .forgives_outside = cycle.may_have_unbooked_work()},
                                        attempt, [&] { undo(island, surfaces); });

  for (SteppedBody* body : island.bodies) {
    body->report.substeps = step.attempt.substeps;
    body->report.retries = step.retries;
    body->report.finite = step.finite;
    if (step.finite) body->last_substeps = step.attempt.substeps;
    body->implicit.has_acceleration = false;
  }
  report_particle_contacts(island);
  surfaces.report();
  find_records(island);
  if (!step.finite) {
    island.records.clear();
    name_bad_particles(island.bodies);
    undo(island, surfaces);
    for (SteppedBody* body : island.bodies) body->step_flows = {};
  }
  give_back(island, duration);
  for (SteppedBody* body : island.bodies) end_step(*body, step.finite ? duration : 0);
}

}  // namespace penalty
