// The part of BackwardEuler that finds the minimum.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "backward_euler.h"
#include "implicit_contacts.h"
#include "implicit_surfaces.h"

namespace penalty {
namespace {

constexpr Real least_energy = 1e-300;  // [J]
constexpr Real round_off2 = 1e-28;     // square of that of positions, relative to the size of the body

// In contact:
constexpr Real friction_change = 0.01;                       // of the limits of friction, of their sum, that is left
constexpr int fewest_between_updates = 4, most_updates = 6;  // iterations, and of the limits
constexpr int times_iterations = 3;                          // as many as without contact, at most
constexpr Real kept_stiffness = 0.005;  // motion that leaves the stiffness as it is, by the distance of particles
constexpr int oldest_stiffness = 4;     // iterations that it is kept
constexpr Real slow_fall = 0.25;        // of the residual in an iteration: then the stiffness is assembled anew,
constexpr Real still_slow = 2;          // unless it fell hardly faster when it was new
constexpr Real surely_enough = 1e-6;    // of the residual that is: no linear solution is sought beyond
constexpr Real loosest = 0.5;           // tolerance of it
constexpr Real settled_gap = 1e-4;      // of what presses [m/s]
constexpr Real sudden = 5;              // approach [speeds gained by gravity in a step] that is an impact

Real stiffness_range(const SteppedBody& body) {
  return kept_stiffness * body.size / std::cbrt(static_cast<Real>(body.particles.size()));
}

// What is left of forces where nothing is, by round-off.
Real noise(const SteppedBody& body, Real duration) {
  const Real stiffness = 1 / (duration * duration) + body.largest_eigenvalue;  // of inertia and elements, per mass
  return round_off2 * body.mass * stiffness * body.rest_span.spreads.squaredNorm();
}

Real square(Real x) { return x * x; }

}  // namespace

void BackwardEuler::book(const NewtonIteration& iteration) {
  for (SteppedBody* body : island_.bodies) {
    ++body->report.newton_iterations;
    body->report.linear_iterations += iteration.linear_iterations;
  }
}

// Where nothing touches: by what each body begins with.
void BackwardEuler::minimize() {
  enough_.clear();
  for (int k = 0; k < most_iterations_; ++k) {
    k == 0 ? keep_stiffness() : forget_stiffness();
    newton_.linearize();
    if (k == 0) {
      newton_.squared_residual();
      for (const SteppedBody* body : island_.bodies) {
        const Real before = newton_.residual_share(body->implicit.first, body->particles.size());
        enough_.push_back(
            std::max({square(body->options.newton_tolerance) * before, noise(*body, inertia_time_), least_energy}));
      }
    }
    const NewtonIteration iteration = newton_.descend();
    book(iteration);
    if (iteration.length == 0 || residual() <= 1) break;
  }
}

// By the energy of each body as it would move without forces, or, if that is more, its share by mass of that of all: what is
// light does not hide behind what is heavy, nor make it wait.
void BackwardEuler::find_enough() {
  const Objective& objective = newton_.objective;
  struct OfBody {
    Real mass, twice_energy, tolerance, noise;
  };
  std::vector<OfBody> bodies;
  Real mass = 0, twice_energy = 0, tolerance = 1;
  const auto add = [&](const OfBody& body) {
    bodies.push_back(body);
    mass += body.mass;
    twice_energy += body.twice_energy;
    tolerance = std::min(tolerance, body.tolerance);
  };
  Real least_noise = std::numeric_limits<Real>::infinity();
  Eigen::Index column = 0;
  for (const SteppedBody* body : island_.bodies) {
    Real twice = 0;
    for (const Real weight : body->implicit.newton.weights) {
      twice += weight * (objective.targets.col(column) - state_.from.col(column)).squaredNorm();
      ++column;
    }
    least_noise = std::min(least_noise, noise(*body, inertia_time_));
    add({body->mass, twice, body->options.newton_tolerance, noise(*body, inertia_time_)});
  }
  for (const RigidInertia& inertia : objective.rigid_bodies) {
    Real twice = 0;
    for (const Matrix3* block : {&inertia.translation, &inertia.rotation}) {
      const Vector3 way = objective.targets.col(column++).head<3>();
      twice += way.dot(*block * way);
    }
    add({duration_ * duration_ * inertia.translation(0, 0), twice, tolerance, least_noise});
  }
  enough_.clear();
  for (const OfBody& body : bodies) {
    const Real share = mass > 0 ? body.mass / mass * twice_energy : 0;
    enough_.push_back(
        std::max({square(body.tolerance) * std::max(body.twice_energy, share) / 2, body.noise, least_energy}));
  }
}

// The largest of a body, by what is enough.
Real BackwardEuler::residual() {
  newton_.squared_residual();
  Real largest = 0;
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < enough_.size(); ++k) {
    const Eigen::Index count = k < island_.bodies.size() ? island_.bodies[k]->particles.size() : 2;
    largest = std::max(largest, std::abs(newton_.residual_share(first, count)) / enough_[k]);
    first += count;
  }
  return largest;
}

void BackwardEuler::forget_stiffness() {
  for (SteppedBody* body : island_.bodies) body->implicit.newton.forget_stiffness();
}

// Where bodies have hardly moved since it was assembled.
void BackwardEuler::keep_stiffness() {
  for (SteppedBody* body : island_.bodies)
    if (NewtonBody& newton = body->implicit.newton;
        !newton.may_keep_stiffness(columns_of(*body, newton_.positions()), stiffness_range(*body)))
      newton.forget_stiffness();
}

void BackwardEuler::take_surfaces(ImplicitContacts& contacts) {
  if (surfaces_) {
    contacts.take_surfaces(newton_.positions());
    contacts.set_hardness();
  }
  newton_.evaluate_again();
}

// Where surfaces may touch, what is begun with must be within reach.
void BackwardEuler::begin_in_contact(ImplicitContacts& contacts) {
  const Objective& objective = newton_.objective;
  newton_.assemble(state_.from);
  if (surfaces_) {
    surfaces_->begin(objective.targets.cols());
    surfaces_->aim(objective.targets - guess(false));
    contacts.take_surfaces(guess(false));
  }
  contacts.set_hardness();
  choose_start();
  if (surfaces_) {
    const PackedVectors start = newton_.positions(), from = guess(false);
    if (surfaces_->aim(start - from) < 1)
      newton_.start(from);
    else
      surfaces_->move(1, start);
    take_surfaces(contacts);
  }
  contacts.predict(objective.targets, sudden * duration_ * gravity_);
}

// By iterations that hold the limits of friction, and updates of these in between.
void BackwardEuler::minimize_in_contact(ImplicitContacts& contacts) {
  find_enough();
  const int most = times_iterations * most_iterations_;
  const Real tolerance = newton_.linear.tolerance;
  int since_update = 0, updates = 0, age = 0;
  Real fresh_fall = 0;
  bool is_fresh = true;  // linearised here
  keep_stiffness();
  newton_.linearize();
  Real left = residual(), before = left;
  for (int k = 0;;) {
    const bool is_balanced = left <= 1;
    if (k > 0 && (is_balanced || since_update >= fewest_between_updates)) {
      const ImplicitContacts::Change change = contacts.limit_change(newton_.positions());
      const bool is_settled = change.limits <= friction_change * change.sum && change.gap < settled_gap * duration_ &&
                              contacts.fit(newton_.positions());
      if ((is_settled && is_balanced) || (updates >= most_updates && is_balanced) || k >= most) break;
      ++updates;
      since_update = 0;
      contacts.update(newton_.positions(), is_balanced, settled_gap * duration_);
      take_surfaces(contacts);
      left = before = residual();
    }
    if (k >= most || !std::isfinite(left)) break;
    if (!is_fresh) {
      const Real fall = left / before;
      if (age == 0 && since_update > 0) fresh_fall = fall;
      const bool is_slow = since_update > 1 && fall > std::max(slow_fall, still_slow * fresh_fall);
      const bool keeps = !is_slow && age < oldest_stiffness;
      age = keeps ? age + 1 : 0;
      if (!keeps) forget_stiffness();
      newton_.linearize();
    }
    is_fresh = false;
    newton_.linear.tolerance =
        contacts.were_predicted() ? tolerance : std::max(tolerance, std::min(loosest, std::sqrt(surely_enough / left)));
    const NewtonIteration iteration = newton_.descend();
    contacts.follow(iteration.length, newton_.direction(), newton_.positions());
    ++k;
    ++since_update;
    book(iteration);
    if (iteration.length == 0 && contacts.were_predicted()) continue;  // what leads to obstacles may lead uphill
    if (iteration.length == 0) break;
    before = left;
    if (contacts.is_cut()) take_surfaces(contacts);
    left = residual();
  }
  newton_.linear.tolerance = tolerance;
}

}  // namespace penalty
