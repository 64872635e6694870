#include "penalty/stepping/damper.h"

#include <algorithm>
#include <cmath>

#include "../math/processors.h"
#include "../math/quadruple.h"
#include "penalty/stepping/stable_step.h"
#include "rigid_state.h"

namespace penalty {
namespace {

constexpr int most_stages = 200;
constexpr int most_tries = 5;
constexpr Real energy_round_off = 1e-12;  // relative
constexpr Real near_rest = 1.02;          // growth of the bound that is none;
constexpr Real safety_at_rest = 1.05,
               safety = 1.35;  // factors of the largest eigenvalue then, and else besides the growth
constexpr Real damping_parameter = 1.3169578969248166;  // d = arcosh 2

// The largest z of |R_s(z)| <= 1/2.
Real reach(int stages) {
  const Real d = damping_parameter / stages;
  return (1 + std::cosh(d)) * stages * std::tanh(damping_parameter) / std::sinh(d);
}

int stages_to_reach(Real z) {
  int stages = std::max(static_cast<int>(std::sqrt(std::min<Real>(z, 2 * most_stages * most_stages) / 1.5)), 1);
  while (stages < most_stages && reach(stages) < z) ++stages;
  return std::min(stages, most_stages);
}

// change before <- a change + b change before - c M^-1 product, what will be the change; product <- 0; now <- the
// velocity with that, less the rigid one: linear + angular x (position - that of the first).
PENALTY_TARGET_CLONES
void end_stage(const Particles& particles, const Vector3& linear, const Vector3& angular, Real a, Real b, Real c,
               const Real* change, Real* change_before, Real* product, Real* now) {
  const Real* v = particles.velocities.data();
  const Real* x = particles.positions.data();
  // angular x position, by the columns of its matrix.
  const Quadruple from_x = {0, angular[2], -angular[1], 0}, from_y = {-angular[2], 0, angular[0], 0},
                  from_z = {angular[1], -angular[0], 0, 0}, common = {linear[0], linear[1], linear[2], 0};
  Quadruple first, arm, velocity, changed, before, force;
  load_quadruple(x, first);
  for (const Real inverse_mass : particles.inverse_masses) {
    load_quadruple(x, arm);
    load_quadruple(v, velocity);
    load_quadruple(change, changed);
    load_quadruple(change_before, before);
    load_quadruple(product, force);
    const Real divisor = inverse_mass > 0 ? inverse_mass : 1;
    changed = changed * a + before * b - force * (c * divisor);
    arm -= first;
    velocity -= common + from_x * arm[0] + from_y * arm[1] + from_z * arm[2];
    store_quadruple(change_before, changed);
    store_quadruple(now, inverse_mass > 0 ? velocity + changed : velocity);
    store_quadruple(product, Quadruple{});
    change += 4;
    change_before += 4;
    product += 4;
    now += 4;
    v += 4;
    x += 4;
  }
}

}  // namespace

bool Damper::has_modes(const PotentialField& field, std::size_t potential) const {
  return field.acts(potential) && field.potentials()[potential]->has_damping_modes();
}

void Damper::add_modes(const PotentialField& field, const Positions& x, Real damping_time, Real duration,
                       DampingModes& modes) const {
  modes.begin();
  for (std::size_t k = 0; k < field.potentials().size(); ++k)
    if (has_modes(field, k)) field.potentials()[k]->add_damping_modes(x, damping_time, duration, modes);
  modes.end();
}

Real Damper::row_bound(const Particles& particles) {
  bounds_.assign(particles.inverse_masses.size(), 0);
  modes_.add_bounds(bounds_);
  Real largest = 0;
  for (std::size_t i = 0; i < bounds_.size(); ++i)
    largest = std::max(largest, bounds_[i] * particles.inverse_masses[i]);
  return largest;
}

void Damper::prepare(const PotentialField& field, Real damping_time, const Particles& particles) {
  const std::size_t size = field.potentials().size();
  // Damping times of elements may have changed: the growth shows that, unless none damped.
  bool same = is_prepared_ && rest_bound_ > 0 && damping_time == damping_time_ &&
              field.stiffness_version() == stiffness_version_ && had_modes_.size() == size;
  had_modes_.resize(size);
  for (std::size_t k = 0; k < size; ++k)
    if (had_modes_[k] != has_modes(field, k)) {
      had_modes_[k] = !had_modes_[k];
      same = false;
    }
  if (same) return;
  const auto walk = [&](DampingModes& modes) { add_modes(field, field.rest_positions(), damping_time, 1, modes); };
  modes_ = DampingModes::with_pattern(walk);
  walk(modes_);
  rest_bound_ = row_bound(particles);
  rest_eigenvalue_ = largest_eigenvalue_bound([this](const Vectors& in, Forces out) { modes_.add_product(in, out); },
                                              rest_bound_, particles.inverse_masses);
  for (PackedVectors* vectors : {&now_, &change_, &change_before_, &product_}) vectors->setZero(4, particles.size());
  damping_time_ = damping_time;
  stiffness_version_ = field.stiffness_version();
  is_prepared_ = true;
}

// Leaves in `now_` what the velocities become, and in `change_` the changes, of what is held the impulse on it. The
// recurrence is that of what has been changed so far: round-off in the velocities themselves would grow with the square
// of the stages. Nothing damps the rigid motion, and D is multiplied with what is left without it: of fast spin it would
// make impulses of the size of round-off that have a torque.
void Damper::run_stages(int stages, Real share, const Particles& particles) {
  const Real d = damping_parameter / stages;
  const Real w0 = std::cosh(d), w1 = share * std::sinh(d) / (stages * std::tanh(damping_parameter));
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  const bool is_free = std::none_of(particles.inverse_masses.begin(), particles.inverse_masses.end(),
                                    [](Real inverse_mass) { return inverse_mass == 0; });
  if (is_free) {
    const RigidState rigid(particles);
    angular = rigid.angular_velocity(rigid.spin);
    linear = rigid.momentum / rigid.mass + angular.cross(particles.positions.col(0).head<3>() - rigid.center);
  }
  change_.setZero();
  change_before_.setZero();
  product_.setZero();
  const auto end = [&](Real a, Real b, Real c) {
    end_stage(particles, linear, angular, a, b, c, change_.data(), change_before_.data(), product_.data(), now_.data());
    change_.swap(change_before_);
  };
  const auto stage = [&](Real a, Real b, Real c) {
    modes_.add_product(now_, product_);
    end(a, b, c);
  };
  end(0, 0, 0);
  Real t_before = 1, t_now = w0;  // T_j(w0)
  stage(1, 0, w1 / w0);
  for (int j = 2; j <= stages; ++j) {
    const Real t_next = 2 * w0 * t_now - t_before;
    stage(2 * w0 * t_now / t_next, -t_before / t_next, 2 * w1 * t_now / t_next);
    t_before = std::exchange(t_now, t_next);
  }
  now_ = particles.velocities;
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] > 0) now_.col(i) += change_.col(i);
}

// Of |R_s| <= 1 follows that the energy grows by no more than this, whatever the velocities of what is held: the part of
// them that the damping of what is free has come to terms with takes work and keeps its energy, the rest decays.
Real Damper::work_of_what_is_held(const Particles& particles) const {
  Real work = 0;
  for (int i = 0; i < particles.size(); ++i)
    if (particles.inverse_masses[i] == 0) work -= particles.velocities.col(i).dot(change_.col(i));
  return work;
}

Damper::Damped Damper::damp(const PotentialField& field, Real damping_time, Real duration, Particles& particles) {
  const Real kinetic = kinetic_energy(particles);
  if (particles.velocities.isZero(0) || !std::isfinite(kinetic)) return {};
  Damped damped;
  Real left = kinetic;
  prepare(field, damping_time, particles);
  if (rest_bound_ > 0) {
    add_modes(field, particles.positions, damping_time, duration, modes_);
    if (growth_ == 0) growth_ = row_bound(particles) / (duration * rest_bound_);
    const Real largest =
        std::min(duration * rest_eigenvalue_ * (growth_ <= near_rest ? safety_at_rest : safety * growth_), 1e300);
    int stages = stages_to_reach(largest);
    const Real share = std::min<Real>(reach(stages) / largest, 1);
    damped.share = 0;
    for (int tries = 0; tries < most_tries && damped.share == 0; ++tries) {
      run_stages(stages, share, particles);
      const Real work = work_of_what_is_held(particles), now = kinetic_energy(now_, particles.inverse_masses);
      if (now <= kinetic + work + energy_round_off * (kinetic + std::abs(work))) {
        particles.velocities = now_;  // not swapped: contacts point into it
        left = now;
        damped.share = share;
        damped.driving_work = work;
      }
      stages = stages + stages / 2 + 1;
    }
  }
  bool dissipates = false;  // element by element, where nothing but what is held can give energy
  for (std::size_t k = 0; k < field.potentials().size(); ++k)
    if (field.acts(k) && !field.potentials()[k]->has_damping_modes()) {
      field.potentials()[k]->dissipate(particles.positions, particles.inverse_masses, damping_time, duration,
                                       particles.velocities);
      dissipates = true;
    }
  if (dissipates) {
    const Real now = kinetic_energy(particles);
    damped.driving_work += std::max<Real>(now - left, 0);
    left = now;
  }
  damped.lost = kinetic + damped.driving_work - left;
  return damped;
}

}  // namespace penalty
