#include "penalty/stepping/step_options.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "penalty/math/text.h"

namespace penalty {

void LinearOptions::check(const char* what) const {
  const auto require = [what](bool ok, const char* name, Real value, const char* range) {
    if (!ok)
      throw std::invalid_argument(std::string(what) + ": linear." + name + " is " + to_text(value) + ", must be " +
                                  range);
  };
  require(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  require(tolerance > 0 && tolerance < 1, "tolerance", tolerance, "in (0, 1)");
}

void StepOptions::check() const {
  const auto require = [](bool ok, const char* name, Real value, const char* range) {
    if (!ok) throw std::invalid_argument(std::string("step: ") + name + " is " + to_text(value) + ", must be " + range);
  };
  require(settling_speed >= 0 && std::isfinite(settling_speed), "settling_speed", settling_speed, "zero or positive");
  require(damping_time >= 0 && std::isfinite(damping_time), "damping_time", damping_time, "zero or positive [s]");
  require(drag >= 0 && std::isfinite(drag), "drag", drag, "zero or positive [1/s]");
  require(substeps >= 0, "substeps", substeps, "zero (automatic) or positive");
  require(safety > 0 && safety <= 1, "safety", safety, "in (0, 1]");
  require(contact_safety > 0 && contact_safety <= 1, "contact_safety", contact_safety, "in (0, 1]");
  require(energy_tolerance > 0, "energy_tolerance", energy_tolerance, "positive");
  require(max_substeps >= 1, "max_substeps", max_substeps, "at least 1");
  require(contact_slop >= 0 && std::isfinite(contact_slop), "contact_slop", contact_slop, "zero or positive [m]");
  require(implicit_order == 1 || implicit_order == 2, "implicit_order", implicit_order, "1 or 2");
  require(newton_iterations >= 1, "newton_iterations", newton_iterations, "at least 1");
  require(newton_tolerance > 0 && newton_tolerance < 1, "newton_tolerance", newton_tolerance, "in (0, 1)");
  linear.check("step");
}

}  // namespace penalty
