// How deep it is where bodies touch, against the geometry of the tests.
#include "bullet/contact_report.h"

namespace penalty::testing {
namespace {

class ContactDepth : public ContactReport {};

// The jelly gives way and is led out, so what is below is measured at the end of the step.
TEST_P(ContactDepth, IsThatOfNodesBelowARigidFaceAndItsMargin) {
  for (const Real mass : {0.0, 10.0}) {
    btSoftBody& jelly = add_box({0, 0, 0});
    btRigidBody& box = sim.add_box({0.4, 0.2, 0.4}, mass, {0.25, 0.69, 0.25});
    sim.step(frame);
    const Real face = to_vector(box.getWorldTransform().getOrigin()).y() - 0.2;
    const Real below = particles(jelly).positions.row(1).maxCoeff() - face;
    EXPECT_GT(below, 1e-3) << "1 cm before the step";
    EXPECT_NEAR(sim.penalty().report(jelly).contact_depth, below + 0.02, 1e-5) << mass << " kg";
    sim.remove(box);
    sim.remove(jelly);
  }
}

TEST_P(ContactDepth, IsThatOfACornerBetweenTheNodesAndTheMargin) {
  for (const Real mass : {0.0, 1.0})
    for (const Real sunk : {0.01, 0.05}) {
      btSoftBody& jelly = add_box({0, 0, 0});
      btRigidBody& box = sim.add_box({0.03, 0.1, 0.03}, mass, {0.28, 0.6 - sunk, 0.27});
      sim.step(frame);
      EXPECT_NEAR(sim.penalty().report(jelly).contact_depth, sunk + 0.02, 1e-3) << mass << " kg, " << sunk << " m";
      sim.remove(box);
      sim.remove(jelly);
    }
}

TEST_P(ContactDepth, OfSoftBodiesThatPierceEachOther) {
  btSoftBody& left = add_box({0, 0, 0});
  add_box({0.48, 0.11, 0.09}, 0.3);
  sim.step(frame);
  EXPECT_NEAR(sim.penalty().report(left).contact_depth, 0.02 + 0.02, 0.008) << "2 cm, and margins of 2 cm";
}

TEST_P(ContactDepth, AtRestIsNone) {
  sim.set_gravity({0, -g, 0});
  sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.02, 0});
  sim.step(frame, 120);
  EXPECT_LT(sim.penalty().report(jelly).contact_depth, 2e-4);
}

INSTANTIATE_TEST_SUITE_P(World, ContactDepth, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
