// advance() allocates in its first step only: every allocation of this program is counted.
#include "math/allocations.h"
#include "penalty/fields/batch_loops.h"
#include "penalty/kinds/user_constraint.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

// Allocations of a second, third .. step.
long allocations(Body& body, std::vector<RigidBody> rigid_bodies = {}) {
  Island island{.bodies = {&body.body}, .rigid_bodies = std::move(rigid_bodies), .contacts = body.contacts};
  penalty::advance(island, 1.0 / 60);
  const long before = num_allocations;
  for (int step = 0; step < 5; ++step) penalty::advance(island, 1.0 / 60);
  return num_allocations - before;
}

TEST(Allocation, IsCounted) {
  const long before = num_allocations;
  EXPECT_EQ(std::make_unique<Body>(make_beam_body(1))->particles().size(), make_beam_body(1).particles().size());
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
  for (const auto& [pinned, order] : {std::pair(false, 1), {true, 1}, {false, 2}, {true, 2}}) {
    Body beam = make_beam_body(1);
    beam.body.options.integrator = Integrator::implicit_step;
    beam.body.options.implicit_order = order;
    beam.body.options.damping_time = 0.01;
    beam.body.gravity = Vector3(0, -10, 0);
    beam.body.external_forces = PackedVectors::Ones(4, beam.particles().size());
    if (pinned) beam.particles().inverse_masses[0] = 0;
    EXPECT_EQ(allocations(beam), 0);
    EXPECT_EQ(beam.body.report.integrator, Integrator::implicit_step);
  }
}

TEST(Allocation, AnchorsNeedNoneInASubstep) {
  std::array<long, 2> counts{};
  for (const std::size_t many : {0, 1}) {
    Body beam = make_beam_body(1);
    beam.body.options.substeps = many ? 400 : 200;
    Island island{.bodies = {&beam.body},
                  .rigid_bodies = {make_sphere(300, 0.5, {2, 1.5, 0.5}), make_sphere(300, 0.5, {2, -0.5, 0.5})}};
    for (int i = 0; i < 6; ++i)
      for (const int rigid : {0, 1})
        if (rigid == 0 || i < 2)
          island.anchors.push_back(
              {.a = Side::of_particles(0, WeightedPoint::at_particle(i)),
               .b = Side::of_rigid(rigid,
                                   beam.position(i) - island.rigid_bodies[static_cast<std::size_t>(rigid)].position)});
    penalty::advance(island, 1.0 / 60);
    const long before = num_allocations;
    penalty::advance(island, 1.0 / 60);
    counts[many] = num_allocations - before;
    EXPECT_GE(beam.body.report.substeps, many ? 400 : 200);
  }
  EXPECT_EQ(counts[0], counts[1]);
}

// A pair of balls on a joint, as what knows its joints says it.
class Ball final : public JointSource {
 public:
  void add_rows(std::span<const RigidBody> bodies, Real h, Real since, std::vector<JointRow>& rows) override {
    const Vector3 at = (bodies[0].position + bodies[1].position) / 2;
    for (int axis = 0; axis < 4; ++axis) {
      const Vector3 n = Vector3::Unit(axis % 3);
      JointRow row{.number = axis,
                   .linear_a = n,
                   .angular_a = (at - bodies[0].position).cross(n),
                   .linear_b = -n,
                   .angular_b = -(at - bodies[1].position).cross(n)};
      if (axis < 3) row.recovery = n.dot(bodies[1].position + Vector3(1, 0, 0) - bodies[0].position) / h;
      if (axis == 3) {  // a brake
        row.most = since;
        row.least = -since;
      }
      rows.push_back(row);
    }
  }
};

TEST(Allocation, JointsNeedNoneInASubstep) {
  std::array<long, 2> counts{};
  for (const std::size_t many : {0, 1}) {
    Body beam = make_beam_body(1);
    beam.body.options.substeps = many ? 400 : 200;
    Ball ball;
    Island island{.bodies = {&beam.body},
                  .rigid_bodies = {make_sphere(3, 0.5, {3, 9, 0}), make_sphere(3, 0.5, {2, 9, 0})},
                  .joints = {{.a = 0, .b = 1}},
                  .joint_source = &ball};
    island.rigid_bodies[0].angular_velocity = Vector3(1, 2, 3);
    penalty::advance(island, 1.0 / 60);
    const long before = num_allocations;
    penalty::advance(island, 1.0 / 60);
    counts[many] = num_allocations - before;
  }
  EXPECT_EQ(counts[0], counts[1]);
}

TEST(Allocation, ARetriedStepNeedsNone) {
  Body beam = make_beam_body(1);
  beam.particles().positions.row(0) *= 4;
  Island island{.bodies = {&beam.body}};
  penalty::advance(island, 1e-9);
  beam.body.last_substeps = 0;
  const long before = num_allocations;
  penalty::advance(island, 1.0 / 60);
  EXPECT_GT(beam.body.report.retries, 0);
  EXPECT_EQ(num_allocations, before);
}

TEST(Allocation, ContactWithRigidBodiesNeedsNone) {
  Body beam = make_beam_body(1);
  RigidBody rigid = make_sphere(10, 1, {0, -1, 0});
  beam.touch(WeightedPoint::at_particle(0), 0, {0, 1, 0}, {0, 1, 0}, 0.5);
  EXPECT_EQ(allocations(beam, {rigid}), 0);
}

// The first makes room for its records.
TEST(Allocation, ASecondHitWithRestitutionNeedsNone) {
  Body beam = make_beam_body(1);
  Island island{.bodies = {&beam.body},
                .rigid_bodies = {RigidBody()},
                .impacts = {{.body = 0, .other_rigid = 0, .restitution = 0.8}}};
  for (int i = 0; i < beam.particles().size(); ++i)
    island.contacts.push_back(
        {.a = Side::of_particles(0, WeightedPoint::at_particle(i)), .b = Side::of_rigid(0, {0, -0.1, 0})});
  const PackedVectors start = beam.particles().positions;
  std::array<long, 2> counts{};
  for (long& count : counts) {
    beam.particles().positions = start;
    for (int i = 0; i < beam.particles().size(); ++i) beam.set_velocity(i, {0, -3, 0});
    beam.body.positions_changed();
    const long before = num_allocations;
    for (int step = 0; step < 30; ++step) penalty::advance(island, 1.0 / 60);
    count = num_allocations - before;
    EXPECT_GT(linear_momentum(beam.particles()).y(), 4000);
  }
  EXPECT_EQ(counts[1], 0);
}

TEST(Allocation, PlasticFlowAndPhasesNeedNone) {
  const TetMesh mesh = make_box({1, 1, 1}, {3, 3, 3});
  PotentialField field =
      make_recovering_field(mesh.vertices, mesh.tetrahedra, {.young = 1e4}, ElasticModel::springs_volumes);
  field.batch<Length>().set_plasticity({.yield = 0.5});
  const auto count = static_cast<std::size_t>(mesh.vertices.cols());
  Body cube = make_body(std::move(field), std::vector<Real>(count, 64));
  EXPECT_EQ(allocations(cube), 0);
}

TEST(Allocation, AnImplicitStepOfElementsOfManyPointsNeedsNone) {
  const TetMesh mesh = make_box({1, 1, 1}, {2, 2, 2});
  PotentialField field = make_elastic_field(mesh.vertices, mesh.tetrahedra, Material{.young = 1e4});
  std::vector<std::vector<int>> everyone(1);
  for (int i = 0; i < mesh.vertices.cols(); ++i) everyone[0].push_back(i);
  const auto constraint = difference_constraint<dynamic>(
      [](const Points<dynamic>& p) -> Real { return p.row(0).squaredNorm(); }, RestValue::relative);
  field.add(constraint, everyone, 10);
  Body cube = make_body(std::move(field), std::vector<Real>(27, 27));
  cube.body.options.integrator = Integrator::implicit_step;
  cube.particles().positions.row(0) *= 1.1;
  EXPECT_EQ(allocations(cube), 0);
}

}  // namespace
}  // namespace penalty::testing
