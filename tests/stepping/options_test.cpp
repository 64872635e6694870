#include <limits>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

std::string refusal(const StepOptions& options) {
  return complaint<std::invalid_argument>([&] { options.check(); });
}

TEST(StepOptions, TheDefaultsKeepEnergyAndAreValid) {
  const StepOptions options;
  EXPECT_NO_THROW(options.check());
  EXPECT_EQ(options.damping_time, 0);
  EXPECT_EQ(options.drag, 0);
}

TEST(StepOptions, NumbersOutOfRangeAreNamed) {
  EXPECT_EQ(refusal({.damping_time = -1}), "step: damping_time is -1, must be zero or positive [s]");
  EXPECT_EQ(refusal({.drag = -2}), "step: drag is -2, must be zero or positive [1/s]");
  EXPECT_EQ(refusal({.substeps = -3}), "step: substeps is -3, must be zero (automatic) or positive");
  EXPECT_EQ(refusal({.safety = 0}), "step: safety is 0, must be in (0, 1]");
  EXPECT_EQ(refusal({.safety = 1.5}), "step: safety is 1.5, must be in (0, 1]");
  EXPECT_EQ(refusal({.contact_safety = 0}), "step: contact_safety is 0, must be in (0, 1]");
  EXPECT_EQ(refusal({.energy_tolerance = 0}), "step: energy_tolerance is 0, must be positive");
  EXPECT_EQ(refusal({.max_substeps = 0}), "step: max_substeps is 0, must be at least 1");
  EXPECT_EQ(refusal({.contact_slop = -1}), "step: contact_slop is -1, must be zero or positive [m]");
  EXPECT_EQ(refusal({.implicit_order = 3}), "step: implicit_order is 3, must be 1 or 2");
  EXPECT_EQ(refusal({.newton_iterations = 0}), "step: newton_iterations is 0, must be at least 1");
  EXPECT_EQ(refusal({.newton_tolerance = 0}), "step: newton_tolerance is 0, must be in (0, 1)");
  EXPECT_EQ(refusal({.linear = {.max_iterations = 0}}), "step: linear.max_iterations is 0, must be at least 1");
  EXPECT_EQ(refusal({.linear = {.tolerance = 1}}), "step: linear.tolerance is 1, must be in (0, 1)");
  const Real nan = std::nan(""), inf = std::numeric_limits<Real>::infinity();
  for (const Real bad : {nan, inf}) {
    EXPECT_NE(refusal({.damping_time = bad}).find("damping_time"), std::string::npos);
    EXPECT_NE(refusal({.drag = bad}).find("drag"), std::string::npos);
    EXPECT_NE(refusal({.contact_slop = bad}).find("contact_slop"), std::string::npos);
    EXPECT_NE(refusal({.safety = bad}).find("safety"), std::string::npos);
  }
  EXPECT_NE(refusal({.energy_tolerance = nan}).find("energy_tolerance"), std::string::npos);
}

TEST(StepOptions, SubstepsAreTakenAsAskedAndNeverBeyondTheMost) {
  Body beam = make_beam_body(1);
  beam.body.options.substeps = 37;
  advance(beam, 1.0 / 60);
  EXPECT_EQ(beam.body.report.substeps, 37);
  Body stiff = make_beam_body(1, {.young = 1e12, .poisson = 0.4});
  stiff.body.options.integrator = Integrator::explicit_step;
  stiff.body.options.max_substeps = 10;
  advance(stiff, 1.0 / 60);
  EXPECT_EQ(stiff.body.report.substeps, 10);
}

TEST(StepOptions, OfTheStiffestBodyCountForTheIsland) {
  Body soft = make_beam_body(1), stiff = make_beam_body(1, {.young = 1e8, .poisson = 0.4});
  Body alone = make_beam_body(1, {.young = 1e8, .poisson = 0.4});
  advance({&soft, &stiff}, 1.0 / 60);
  advance(alone, 1.0 / 60);
  EXPECT_GT(alone.body.report.substeps, 10);
  EXPECT_EQ(soft.body.report.substeps, alone.body.report.substeps);
  EXPECT_EQ(stiff.body.report.substeps, alone.body.report.substeps);
}

}  // namespace
}  // namespace penalty::testing
