#include "penalty/stepping/step.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "explicit_step.h"
#include "implicit_step.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

bool steps_implicitly(const SteppedBody& body, Real duration) {
  if (body.particles.size() == 0) return false;
  if (body.options.integrator != Integrator::automatic) return body.options.integrator == Integrator::implicit_step;
  return body.options.substeps == 0 &&
         duration * std::sqrt(body.largest_eigenvalue) / 2 > crossover_substeps * body.options.safety;
}

}  // namespace

void StepOptions::check() const {
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok) throw std::invalid_argument(std::string("step: ") + name + " is " + to_text(value) + ", must be " + range);
  };
  require(damping_time >= 0 && std::isfinite(damping_time), "damping_time", damping_time, "zero or positive [s]");
  require(drag >= 0 && std::isfinite(drag), "drag", drag, "zero or positive [1/s]");
  require(substeps >= 0, "substeps", substeps, "zero (automatic) or positive");
  require(safety > 0 && safety <= 1, "safety", safety, "in (0, 1]");
  require(contact_safety > 0 && contact_safety <= 1, "contact_safety", contact_safety, "in (0, 1]");
  require(energy_tolerance > 0, "energy_tolerance", energy_tolerance, "positive");
  require(max_substeps >= 1, "max_substeps", max_substeps, "at least 1");
  require(contact_slop >= 0 && std::isfinite(contact_slop), "contact_slop", contact_slop, "zero or positive [m]");
  require(newton_iterations >= 1, "newton_iterations", newton_iterations, "at least 1");
  require(newton_tolerance > 0 && newton_tolerance < 1, "newton_tolerance", newton_tolerance, "in (0, 1)");
  require(linear.max_iterations >= 1, "linear.max_iterations", linear.max_iterations, "at least 1");
  require(linear.tolerance > 0 && linear.tolerance < 1, "linear.tolerance", linear.tolerance, "in (0, 1)");
}

std::span<const EnergyFlows::Part> EnergyFlows::parts() {
  static constexpr Part list[] = {{"constant_forces", &EnergyFlows::constant_forces},
                                  {"contacts", &EnergyFlows::contacts},
                                  {"couplings", &EnergyFlows::couplings},
                                  {"driving", &EnergyFlows::driving},
                                  {"changes", &EnergyFlows::changes},
                                  {"damping", &EnergyFlows::damping},
                                  {"drag", &EnergyFlows::drag},
                                  {"inelastic", &EnergyFlows::inelastic},
                                  {"integration", &EnergyFlows::integration},
                                  {"contact_loss", &EnergyFlows::contact_loss}};
  return list;
}

EnergyFlows& EnergyFlows::operator+=(const EnergyFlows& other) {
  for (const Part& part : parts()) this->*part.member += other.*part.member;
  return *this;
}

void advance(std::span<SteppedBody* const> bodies, std::span<RigidBody> rigid_bodies, Real duration,
             std::span<Coupling* const> couplings) {
  if (bodies.empty() || !(duration > 0)) return;
  const bool alone = bodies.size() == 1 && couplings.empty() && bodies[0]->contacts.empty();
  if (alone && steps_implicitly(*bodies[0], duration))
    advance_implicitly(*bodies[0], duration);
  else
    advance_explicitly(bodies, rigid_bodies, duration, couplings);
}

}  // namespace penalty
