// advance() allocates in its first step only: every allocation of this program is counted.
#include "math/allocations.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// Allocations of a second, third .. step.
long allocations(Body& body, std::span<RigidBody> rigid_bodies = {}) {
  SteppedBody* bodies[] = {&body.body};
  penalty::advance(bodies, rigid_bodies, 1.0 / 60);
  const long before = num_allocations;
  for (int step = 0; step < 5; ++step) penalty::advance(bodies, rigid_bodies, 1.0 / 60);
  return num_allocations - before;
}

TEST(Allocation, IsCounted) {
  const long before = num_allocations;
  const std::vector<int> v(10);
  EXPECT_GT(num_allocations, before);
}

TEST(Allocation, AFreeBodyNeedsNone) {
  Body beam = make_beam_body(1);
  EXPECT_EQ(allocations(beam), 0);
}

TEST(Allocation, DampingDragGravityAndExternalForcesNeedNone) {
  Body beam = make_beam_body(1);
  beam.body.gravity = Vector3(0, -10, 0);
  beam.body.options.damping_time = 0.01;
  beam.body.options.drag = 0.1;
  beam.body.external_forces = PackedVectors::Ones(4, beam.particles().size());
  EXPECT_EQ(allocations(beam), 0);
}

TEST(Allocation, AnImplicitStepNeedsNone) {
  for (const bool pinned : {false, true}) {
    Body beam = make_beam_body(1);
    beam.body.options.integrator = Integrator::implicit_step;
    beam.body.options.damping_time = 0.01;
    beam.body.gravity = Vector3(0, -10, 0);
    beam.body.external_forces = PackedVectors::Ones(4, beam.particles().size());
    if (pinned) beam.particles().inverse_masses[0] = 0;
    EXPECT_EQ(allocations(beam), 0);
    EXPECT_EQ(beam.body.report.integrator, Integrator::implicit_step);
  }
}

TEST(Allocation, ARetriedStepNeedsNone) {
  Body beam = make_beam_body(1);
  beam.particles().positions.row(0) *= 4;
  SteppedBody* bodies[] = {&beam.body};
  penalty::advance(bodies, {}, 1e-9);
  beam.body.last_substeps = 0;
  const long before = num_allocations;
  penalty::advance(bodies, {}, 1.0 / 60);
  EXPECT_GT(beam.body.report.retries, 0);
  EXPECT_EQ(num_allocations, before);
}

TEST(Allocation, ContactWithRigidBodiesNeedsNone) {
  Body beam = make_beam_body(1);
  RigidBody rigid = make_sphere(10, 1, {0, -1, 0});
  beam.body.contacts.push_back({ContactPoint::at_particle(0), 0, {0, 1, 0}, {0, 1, 0}, 0.5});
  EXPECT_EQ(allocations(beam, std::span(&rigid, 1)), 0);
}

}  // namespace
}  // namespace penalty::testing
