// Kinematic bodies carry, lift and wake soft ones, made kinematic by the flag alone or as Bullet's manual has it, with the
// static flag that a body without mass has.
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Real frame = 1.0 / 60;

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

// Its links carry what they hit along, and are not braked by it.
class Links : public WorldTest {};

TEST_P(Links, OfAMultibodyPushAtTheirOwnSpeed) {
  for (const bool of_base : {true, false}) {
    SCOPED_TRACE(of_base);
    Simulation of(GetParam());
    btSoftBody& body = of.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}), {.attach = {.step = {.damping_time = 0.02}}});
    btBoxShape shape(btVector3(btScalar(0.1), btScalar(0.3), btScalar(0.3)));
    btMultiBody multibody(of_base ? 0 : 1, 1, btVector3(1, 1, 1), !of_base, false);
    const btQuaternion none(0, 0, 0, 1);
    multibody.setBaseWorldTransform(btTransform(none, btVector3(btScalar(-0.2), btScalar(0.2), btScalar(0.2))));
    if (!of_base)
      multibody.setupPrismatic(0, 1, btVector3(1, 1, 1), -1, none, btVector3(1, 0, 0), btVector3(0, 0, 0),
                               btVector3(0, 0, 0), true);
    multibody.finalizeMultiDof();
    multibody.setLinearDamping(0);
    if (of_base)
      multibody.setBaseVel(btVector3(1, 0, 0));
    else
      multibody.setJointVel(0, 1);
    btMultiBodyLinkCollider collider(&multibody, of_base ? -1 : 0);
    collider.setCollisionShape(&shape);
    collider.setWorldTransform(multibody.getBaseWorldTransform());
    if (of_base)
      multibody.setBaseCollider(&collider);
    else
      multibody.getLink(0).m_collider = &collider;
    of.deformable_world().addCollisionObject(&collider);
    of.deformable_world().addMultiBody(&multibody);
    of.step(frame, 60);
    const Real face = Real(collider.getWorldTransform().getOrigin().x()) + 0.1;
    EXPECT_NEAR(face, 0.9, 0.02) << "goes on";
    const Particles& particles = of.penalty().particles(body);
    EXPECT_GT(particles.positions.row(0).minCoeff(), face);
    EXPECT_GT(linear_momentum(particles).x(), 0.95) << "of 1 kg";
    of.deformable_world().removeMultiBody(&multibody);
    of.deformable_world().removeCollisionObject(&collider);
  }
}

INSTANTIATE_TEST_SUITE_P(World, Links, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
