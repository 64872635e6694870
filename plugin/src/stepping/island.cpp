#include "penalty/stepping/island.h"

#include <algorithm>
#include <cmath>

#include "explicit_step.h"
#include "implicit_step.h"
#include "surface_contacts.h"

namespace penalty {
namespace {

bool wants_implicit_step(const SteppedBody& body, Real duration) {
  if (body.particles.size() == 0) return false;
  if (body.options.integrator != Integrator::automatic) return body.options.integrator == Integrator::implicit_step;
  return body.options.substeps == 0 &&
         duration * std::sqrt(body.largest_eigenvalue) / 2 > crossover_substeps * body.options.safety;
}

bool steps_implicitly(Island& island, Real duration) {
  if (island.bodies.size() != 1 || !island.couplings.empty() || !island.contacts.empty() || !island.anchors.empty() ||
      !island.rigid_contacts.empty() || !island.joints.empty())
    return false;
  if (!wants_implicit_step(*island.bodies.front(), duration)) return false;
  SurfaceContacts surfaces(island);
  surfaces.begin_step(duration);
  return surfaces.least_substeps() == 1;  // far from itself
}

StepReport report_of(const Island& island) {
  StepReport sum;
  for (const SteppedBody* body : island.bodies) {
    const StepReport& report = body->report;
    sum.integrator = report.integrator;
    sum.substeps = std::max(sum.substeps, report.substeps);
    sum.newton_iterations += report.newton_iterations;
    sum.linear_iterations += report.linear_iterations;
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
  if (!island.surfaces.empty() && island.surface_scratch)
    sum.num_contacts += static_cast<int>(island.surface_scratch->pairs.size());
  return sum;
}

}  // namespace

StepReport advance(Island& island, Real duration) {
  island.records.clear();
  if (island.bodies.empty() || !(duration > 0) || !std::isfinite(duration)) return {};
  if (steps_implicitly(island, duration))
    advance_implicitly(*island.bodies.front(), duration);
  else
    advance_explicitly(island, duration);
  return report_of(island);
}

}  // namespace penalty
