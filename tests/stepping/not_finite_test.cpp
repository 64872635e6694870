// A step that cannot be made finite is undone and reported.
#include <cstring>
#include <limits>

#include "stepping/islands.h"

namespace penalty::testing {
namespace {

bool same_bits(const PackedVectors& a, const PackedVectors& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Real)) == 0;
}

// A beam one of whose particles got an impossible velocity.
void expect_undone(Real speed) {
  SCOPED_TRACE(::testing::Message() << "speed " << speed);
  Body beam = make_beam_body(1);
  advance(beam, 1.0 / 60);
  const int bad = 7;
  beam.set_velocity(bad, {0, speed, 0});
  beam.body.options.max_substeps = 300;
  const PackedVectors x = beam.particles().positions, v = beam.particles().velocities;
  RigidBody rigid = make_sphere(1, 1, {0, 50, 0});
  rigid.velocity = Vector3(1, 2, 3);
  advance(beam, 1.0 / 60, std::span(&rigid, 1));
  EXPECT_FALSE(beam.body.report.finite);
  EXPECT_EQ(beam.body.report.first_bad_particle, bad);
  EXPECT_TRUE(same_bits(beam.particles().positions, x));
  EXPECT_TRUE(same_bits(beam.particles().velocities, v));
  EXPECT_EQ(rigid.position, Vector3(0, 50, 0));
  EXPECT_EQ(rigid.velocity, Vector3(1, 2, 3));
  // Mended, the body goes on.
  beam.set_velocity(bad, {0, 0, 0});
  advance(beam, 1.0 / 60);
  EXPECT_TRUE(beam.body.report.finite);
  EXPECT_EQ(beam.body.report.first_bad_particle, -1);
  EXPECT_LT((beam.particles().positions - beam.field->rest_positions()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(NotFinite, AVelocityThatIsNotANumberIsReportedByItsParticle) { expect_undone(std::nan("")); }
TEST(NotFinite, AnInfiniteVelocityIsReportedByItsParticle) { expect_undone(std::numeric_limits<Real>::infinity()); }
TEST(NotFinite, AHugeVelocityIsReportedByItsParticle) { expect_undone(1e200); }

TEST(NotFinite, APositionIsReportedByItsParticle) {
  Body beam = make_beam_body(1);
  beam.body.options.max_substeps = 100;
  beam.set_position(9, {std::nan(""), 0, 0});
  advance(beam, 1.0 / 60);
  EXPECT_FALSE(beam.body.report.finite);
  EXPECT_EQ(beam.body.report.first_bad_particle, 9);
}

TEST(NotFinite, TheReportedEnergiesAreThoseOfTheStateThatWasKept) {
  // A force that overflows: the state at the start is finite, and it is what the body is left with.
  Body beam = make_beam_body(1);
  beam.set_velocity(3, {1, 0, 0});
  beam.body.external_forces = PackedVectors::Zero(4, beam.particles().size());
  beam.body.external_forces(1, 3) = 1e300;
  beam.body.options.max_substeps = 300;
  const Real kinetic = kinetic_energy(beam.particles());
  advance(beam, 1.0 / 60);
  ASSERT_FALSE(beam.body.report.finite);
  EXPECT_EQ(beam.body.report.kinetic_energy, kinetic);
  EXPECT_EQ(beam.body.report.elastic_energy, beam.field->energy(beam.particles().positions));
}

TEST(NotFinite, TheSubstepsThatWereOfNoUseAreForgotten) {
  Body beam = make_beam_body(1);
  advance(beam, 1.0 / 60);
  const int usual = beam.body.report.substeps;
  beam.body.external_forces = PackedVectors::Zero(4, beam.particles().size());
  beam.body.external_forces(1, 3) = 1e300;
  beam.body.options.max_substeps = 50 * usual;
  advance(beam, 1.0 / 60);
  ASSERT_FALSE(beam.body.report.finite);
  ASSERT_EQ(beam.body.report.substeps, 50 * usual);
  beam.body.external_forces(1, 3) = 1;
  beam.body.positions_changed();
  advance(beam, 1.0 / 60);
  EXPECT_TRUE(beam.body.report.finite);
  EXPECT_LE(beam.body.report.substeps, 2 * usual);
}

TEST(NotFinite, TheStartIsNotStretchedOverThousandsOfHopelessSubsteps) {
  // More substeps cannot cure a start that is not finite.
  Body beam = make_beam_body(1);
  beam.set_velocity(2, {std::nan(""), 0, 0});
  advance(beam, 1.0 / 60);
  ASSERT_FALSE(beam.body.report.finite);
  EXPECT_LE(beam.body.report.retries, 1);
}

TEST(NotFinite, OneBodyUndoesTheWholeIsland) {
  Body good = make_beam_body(1), bad = make_beam_body(1);
  for (Body* body : {&good, &bad}) body->body.options.max_substeps = 100;
  good.set_velocity(0, {1, 0, 0});
  bad.set_velocity(5, {std::nan(""), 0, 0});
  const PackedVectors x = good.particles().positions;
  advance({&good, &bad}, 1.0 / 60);
  EXPECT_FALSE(good.body.report.finite);
  EXPECT_FALSE(bad.body.report.finite);
  EXPECT_EQ(good.body.report.first_bad_particle, -1);  // it is not this one's fault
  EXPECT_EQ(good.particles().positions, x);
}

}  // namespace
}  // namespace penalty::testing
