// Kinematic bodies carry, lift and wake soft ones, made kinematic by the flag alone or as Bullet's manual has it, with the
// static flag that a body without mass has.

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

class Movers : public WorldTest {
 protected:
  void SetUp() override { sim.set_gravity({0, -9.81, 0}); }

  btRigidBody& add_platform(bool keeps_static_flag) {
    btRigidBody& platform = sim.add_box({3, 0.1, 3}, 0, {0, -0.1, 0});
    platform.setFriction(1);
    platform.setCollisionFlags((keeps_static_flag ? platform.getCollisionFlags() : 0) |
                               btCollisionObject::CF_KINEMATIC_OBJECT);
    platform.forceActivationState(DISABLE_DEACTIVATION);
    return platform;
  }
  btSoftBody& add_box(const Vector3& at) {
    return sim.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}),
                         {.shift = at, .attach = {.step = {.damping_time = 0.02}}});
  }
  void step(btRigidBody& platform, const Vector3& origin, Real angle) {
    btTransform transform(btQuaternion(btVector3(0, 1, 0), static_cast<btScalar>(angle)), to_bullet(origin));
    platform.setWorldTransform(transform);
    sim.step(frame);
  }
};

TEST_P(Movers, ATurntableCarriesABody) {
  for (const bool keeps_static_flag : {false, true}) {
    btRigidBody& platform = add_platform(keeps_static_flag);
    btSoftBody& body = add_box({0.8, 0.021, -0.2});
    const Vector3 before = center_of_mass(sim.penalty().particles(body));
    Real angle = 0;
    for (int k = 0; k < 120; ++k) step(platform, {0, -0.1, 0}, angle += std::min<Real>(1, k * frame) * frame);
    const Vector3 after = center_of_mass(sim.penalty().particles(body));
    const Vector3 carried = Eigen::AngleAxis<Real>(angle, Vector3::UnitY()) * before;
    EXPECT_LT((after - carried).norm(), 0.01 * carried.norm()) << keeps_static_flag;
    sim.remove(body);
    sim.remove(platform);
  }
}

TEST_P(Movers, ALiftLiftsABodyAtItsUsualCost) {
  for (const bool keeps_static_flag : {false, true}) {
    btRigidBody& platform = add_platform(keeps_static_flag);
    btSoftBody& body = add_box({-0.2, 0.021, -0.2});
    for (int k = 0; k < 30; ++k) step(platform, {0, -0.1, 0}, 0);
    const int at_rest = sim.penalty().report(body).substeps;
    int most = 0;
    Real lowest_above = 1;
    for (int k = 1; k <= 90; ++k) {
      step(platform, {0, -0.1 + 0.5 * k * frame, 0}, 0);
      most = std::max(most, sim.penalty().report(body).substeps);
      lowest_above = std::min(lowest_above, lowest(body) - 0.5 * k * frame);
    }
    EXPECT_LE(most, 2 * at_rest) << keeps_static_flag;
    EXPECT_GT(lowest_above, 0.0199) << keeps_static_flag << ": margin 0.02";
    EXPECT_LT(lowest(body), 0.75 + 0.06) << keeps_static_flag;
    sim.remove(body);
    sim.remove(platform);
  }
}

TEST_P(Movers, AMoverWakesABodyThatSleeps) {
  for (const bool keeps_static_flag : {false, true}) {
    sim.add_ground();
    btRigidBody& platform = add_platform(keeps_static_flag);
    btSoftBody& body = add_box({-0.2, 0.021, -0.2});
    step(platform, {0, -3, 0}, 0);
    body.forceActivationState(ISLAND_SLEEPING);
    const Real before = center_of_mass(sim.penalty().particles(body)).x();
    for (int k = 0; k < 60; ++k) step(platform, {-4.3 + 2 * k * frame, 0.2, 0}, 0);
    EXPECT_TRUE(body.isActive()) << keeps_static_flag;
    EXPECT_GT(center_of_mass(sim.penalty().particles(body)).x(), before + 0.2) << keeps_static_flag;
    sim.remove(body);
    sim.remove(platform);
  }
}

INSTANTIATE_TEST_SUITE_P(World, Movers, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
