// What contacts gave in a step, against the change of momentum that is not gravity's.
#include <numbers>

#include "penalty/contact/surface_pair.h"
#include "stepping/islands.h"

namespace penalty::testing {
namespace {

constexpr Real angle = std::numbers::pi / 6, mass = 2;
const Vector3 slope_gravity = 10 * Vector3(std::sin(angle), -std::cos(angle), 0);  // on a slope of 30 degrees

// A particle that starts at rest on y = 0; `touch` adds what it lies on.
template <class Touch>
void expect_weight_on_slope(Real friction, Real height, const Touch& touch) {
  SCOPED_TRACE(friction);
  Body point = make_free_particles(Eigen::Matrix3Xd(Vector3(0, height, 0)), {mass});
  point.body.gravity = slope_gravity;
  for (int k = 0; k < 20; ++k) {
    Island island;
    island.bodies = {&point.body};
    touch(island);
    const Vector3 before = point.velocity(0);
    advance(island, frame);
    ASSERT_EQ(island.records.size(), 1);
    const ContactRecord& record = island.records.front();
    EXPECT_EQ(record.body, 0);
    EXPECT_LT((record.normal - Vector3(0, 1, 0)).norm(), 1e-12);
    const Vector3 given = mass * (point.velocity(0) - before - frame * slope_gravity);
    EXPECT_LT((record.impulse - given).norm(), 1e-13);
    EXPECT_EQ(record.slides, friction < std::tan(angle)) << "step " << k;
    EXPECT_NEAR(record.gap, 0, 1e-12);
    EXPECT_NEAR(point.body.report.contact_depth, 0, 1e-12);
    EXPECT_LT((record.point - point.position(0)).norm(), 0.05);
  }
}

TEST(ContactRecord, OfAParticleOnAPlaneIsWhatItWasGiven) {
  for (const Real friction : {0.0, 0.3, 0.7})
    expect_weight_on_slope(friction, 0, [&](Island& island) {
      island.rigid_bodies.resize(1);
      island.contacts = {{.a = Side::of_particles(0, WeightedPoint::at_particle(0)),
                          .b = Side::of_rigid(0, Vector3::Zero()),
                          .friction = friction}};
    });
}

TEST(ContactRecord, OfAPointAtATriangleIsWhatItWasGiven) {
  Eigen::Matrix3Xd corners(3, 3);
  corners << -1, 1, 0, 0, 0, 0, 0.6, 0.6, -1.2;
  for (const Real friction : {0.0, 0.3, 0.7}) {
    Body triangle = make_free_particles(corners, {1, 1, 1});
    triangle.particles().inverse_masses.assign(3, 0);
    ContactSurface under({WeightedPoint::at_particle(0), WeightedPoint::at_particle(1), WeightedPoint::at_particle(2)},
                         {{0, 1, 2}}, {}, triangle.particles().positions);
    ContactSurface over({WeightedPoint::at_particle(0)}, {}, {}, PackedVectors::Zero(4, 1));
    under.margin = over.margin = 0.05;
    under.friction = 1;
    over.friction = friction;
    SurfacePair pair(over, under);
    expect_weight_on_slope(friction, 0.05, [&](Island& island) {
      island.bodies.push_back(&triangle.body);
      island.surfaces = {{&pair, 0, 1}};
    });
  }
}

TEST(ContactRecord, OfWhatComesApartIsNone) {
  Body point = make_free_particles(Eigen::Matrix3Xd(Vector3(0, 0, 0)), {mass});
  point.set_velocity(0, {0, 1, 0});
  Island island;
  island.bodies = {&point.body};
  island.rigid_bodies.resize(1);
  island.contacts = {{.a = Side::of_particles(0, WeightedPoint::at_particle(0)), .b = Side::of_rigid(0, {0, 0, 0})}};
  advance(island, frame);
  EXPECT_TRUE(island.records.empty());
  EXPECT_LT(point.body.report.contact_depth, 1e-15);
}

TEST(ContactRecord, DepthIsThatOfTheEnd) {
  Body point = make_free_particles(Eigen::Matrix3Xd(Vector3(0, -0.3, 0)), {mass});
  point.body.options.contact_slop = 0;
  Island island;
  island.bodies = {&point.body};
  island.rigid_bodies.resize(1);
  island.contacts = {{.a = Side::of_particles(0, WeightedPoint::at_particle(0)), .b = Side::of_rigid(0, {0, 0, 0})}};
  advance(island, frame);
  EXPECT_GT(point.position(0).y(), -0.3) << "comes back";
  EXPECT_NEAR(point.body.report.contact_depth, -point.position(0).y(), 1e-15);
}

}  // namespace
}  // namespace penalty::testing
