#include "penalty/stepping/island.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "explicit_step.h"
#include "implicit_step.h"
#include "implicit_surfaces.h"
#include "restitution.h"
#include "rigid_contacts.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

// All of it slower than what comes to rest, seen from what holds it up.
bool lies(const Island& island) {
  const RigidBody still, *ground = &still;
  for (const Contact& contact : island.contacts)
    if (contact.b.is_rigid() && !island.rigid_bodies[contact.b.rigid].is_dynamic())
      ground = &island.rigid_bodies[contact.b.rigid];
  Real limit = std::numeric_limits<Real>::infinity();
  for (const SteppedBody* body : island.bodies)
    limit = std::min(limit, body->options.settling_speed * std::sqrt(body->gravity.norm() * body->size));
  const auto is_slow = [&](const Vector3& position, const Vector3& velocity) {
    return (velocity - ground->velocity_at(position - ground->position)).norm() < limit;
  };
  for (const RigidBody& rigid : island.rigid_bodies)
    if (rigid.is_dynamic() && !is_slow(rigid.position, rigid.velocity)) return false;
  for (const SteppedBody* body : island.bodies)
    for (int i = 0; i < body->particles.size(); ++i)
      if (!is_slow(body->particles.positions.col(i).head<3>(), body->particles.velocities.col(i).head<3>()))
        return false;
  return true;
}

// An impact is for substeps, as long as they can be taken, unless somebody wants backward Euler, which eats the rebound. All
// bodies take as many as that which needs most.
bool wants_implicit_step(const Island& island, Real duration, bool touches) {
  bool is_automatic = false, pays = false, is_too_stiff = false, may_bounce = true;
  for (const SteppedBody* body : island.bodies) {
    if (body->particles.size() == 0 || body->options.integrator == Integrator::explicit_step) return false;
    const Real limit = duration * std::sqrt(body->largest_eigenvalue) / 2;
    is_too_stiff = is_too_stiff || limit > body->options.max_substeps;
    if (body->options.integrator == Integrator::automatic) {
      if (body->options.substeps != 0) return false;
      const Real share = touches ? body->options.contact_safety : body->options.safety;
      is_automatic = true;
      pays = pays || limit > crossover_substeps * body->options.implicit_order * share;
    } else {
      may_bounce = may_bounce && body->options.implicit_order == 2;
    }
  }
  if (is_automatic && !pays) return false;
  return !touches || is_too_stiff || (!is_automatic && !may_bounce) || lies(island);
}

bool may_bounce(const RigidContact& contact, const Island& island) {
  const RigidBody &a = island.rigid_bodies[contact.a], &b = island.rigid_bodies[contact.b];
  const RigidContactPlace place = place_of(contact, island);
  const Vector3 speed = a.velocity_at(place.at - a.position) - b.velocity_at(place.at - b.position);
  return contact.restitution > 0 && -place.normal.dot(speed) > restitution_threshold;
}

bool may_step_implicitly(const Island& island) {
  if (!island.couplings.empty() || !island.joints.empty()) return false;
  for (const Anchor& anchor : island.anchors)
    if (anchor.influence < 1) return false;
  for (const RigidBody& rigid : island.rigid_bodies)
    if (rigid.is_dynamic() && !rigid.is_free()) return false;
  return std::ranges::none_of(island.rigid_contacts,
                              [&island](const RigidContact& contact) { return may_bounce(contact, island); });
}

StepReport report_of(const Island& island) {
  StepReport sum;
  for (const SteppedBody* body : island.bodies) {
    const StepReport& report = body->report;
    sum.integrator = report.integrator;
    sum.substeps = std::max(sum.substeps, report.substeps);
    sum.newton_iterations = std::max(sum.newton_iterations, report.newton_iterations);
    sum.linear_iterations = std::max(sum.linear_iterations, report.linear_iterations);
    sum.unfolded = sum.unfolded || report.unfolded;
    sum.retries = std::max(sum.retries, report.retries);
    sum.finite = sum.finite && report.finite;
    sum.damping_share = std::min(sum.damping_share, report.damping_share);
    sum.elastic_energy += report.elastic_energy;
    sum.kinetic_energy += report.kinetic_energy;
    sum.contact_depth = std::max(sum.contact_depth, report.contact_depth);
    sum.restored_momentum = std::max(sum.restored_momentum, report.restored_momentum);
    sum.restored_spin = std::max(sum.restored_spin, report.restored_spin);
    sum.capped_energy += report.capped_energy;
  }
  sum.num_contacts = static_cast<int>(island.contacts.size());
  if (!island.surfaces.empty() && island.surface_scratch) sum.num_contacts += island.surface_scratch->num_touching;
  return sum;
}

}  // namespace

StepReport advance(Island& island, Real duration) {
  island.records.clear();
  if (island.bodies.empty() || !(duration > 0) || !std::isfinite(duration)) return {};
  if (may_step_implicitly(island) && wants_implicit_step(island, duration, !island.contacts.empty())) {
    SurfaceContacts surfaces(island);
    surfaces.begin_step(duration);
    ImplicitSurfaces near(island);
    near.are_near = surfaces.least_substeps() > 1;
    near.may_be_near = near.can_step(duration) && wants_implicit_step(island, duration, true);
    if ((!near.are_near || near.may_be_near) && advance_implicitly(island, near, duration)) return report_of(island);
  }
  advance_explicitly(island, duration);
  return report_of(island);
}

}  // namespace penalty
