// What contacts report: against weights, momenta and places that the tests know by themselves.
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <numbers>

#include "bullet/contact_report.h"

namespace penalty::testing {
namespace {

Vector3 sum_of(std::span<const BodyContact> contacts) {
  Vector3 sum = Vector3::Zero();
  for (const BodyContact& contact : contacts) sum += contact.impulse;
  return sum;
}

Real mass_of(const Particles& particles) {
  Real mass = 0;
  for (const Real inverse_mass : particles.inverse_masses) mass += 1 / inverse_mass;
  return mass;
}

// Frames are averaged, as what lies on the other still rings by a thousandth of its weight.
TEST_P(ContactReport, OfABoxOnJellyOnTheGroundIsTheirWeights) {
  sim.set_gravity({0, -g, 0});
  btRigidBody& ground = sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.02, 0});
  btRigidBody& box = sim.add_box({0.15, 0.1, 0.15}, 0.5, {0.25, 0.66, 0.25});
  sim.step(frame, 300);
  ContactForce on_box, on_ground;
  Vector3 on_jelly = Vector3::Zero();
  constexpr int frames = 20;
  for (int k = 0; k < frames; ++k) {
    sim.step(frame);
    const ContactForce to_box = sim.penalty().contact_force(box), to_ground = sim.penalty().contact_force(ground);
    on_box.force += to_box.force / frames;
    on_box.torque += to_box.torque / frames;
    on_ground.force += to_ground.force / frames;
    on_jelly += sum_of(contacts(jelly)) / frame / frames;
  }
  const Real weight = 0.5 * g, of_jelly = mass_of(particles(jelly)) * g;
  EXPECT_LT((on_box.force - Vector3(0, weight, 0)).norm(), 1e-3 * weight);
  EXPECT_LT(on_box.torque.norm(), 1e-3 * weight * 0.15);
  EXPECT_LT((on_ground.force - Vector3(0, -weight - of_jelly, 0)).norm(), 1e-3 * (weight + of_jelly));
  EXPECT_LT((on_jelly - Vector3(0, of_jelly, 0)).norm(), 1e-3 * of_jelly);
  for (const BodyContact& contact : contacts(jelly)) {
    const bool is_below = contact.point.y() < 0.3;
    EXPECT_EQ(contact.object, is_below ? &ground : &box);
    EXPECT_GT((is_below ? 1 : -1) * contact.normal.y(), 0.9) << "off the object";
    EXPECT_GT(contact.normal_impulse(), 0);
    EXPECT_LT(std::abs(contact.gap), 1e-3) << contact.point.transpose();
    EXPECT_FALSE(contact.is_new);
  }
}

TEST_P(ContactReport, OfJellyOnASlopeIsWhatHoldsIt) {
  sim.set_gravity({0, -g, 0});
  const Real slope = std::numbers::pi / 9;
  const Matrix3 turned = Eigen::AngleAxis<Real>(slope, Vector3::UnitZ()).toRotationMatrix();
  const Vector3 up = turned.col(1), along = turned.col(0);
  for (const Real friction : {0.6, 0.2}) {
    SCOPED_TRACE(friction);
    btRigidBody& ground = sim.add_box({20, 0.5, 20}, 0, -0.5 * up, turned);
    ground.setFriction(static_cast<btScalar>(friction));
    TetMesh mesh = make_box({0.5, 0.3, 0.5}, {4, 3, 4});
    mesh.vertices = turned * mesh.vertices;
    btSoftBody& jelly =
        sim.add_jelly(mesh, {.stiffness = 50, .shift = Vector3(0.02 * up), .attach = {.step = {.damping_time = 0.05}}});
    const bool holds = friction > std::tan(slope);
    sim.step(frame, holds ? 240 : 60);
    Real normal = 0, tangential = 0, sliding = 0;
    constexpr int frames = 20;
    for (int k = 0; k < frames; ++k) {
      sim.step(frame);
      for (const BodyContact& contact : contacts(jelly)) {
        EXPECT_EQ(contact.object, &ground);
        EXPECT_LT((contact.normal - up).norm(), 1e-6);
        normal += contact.normal_impulse() / frame / frames;
        tangential += contact.friction_impulse().dot(along) / frame / frames;
        if (contact.slides) sliding += contact.normal_impulse() / frame / frames;
      }
    }
    const Real weight = mass_of(particles(jelly)) * g;
    EXPECT_NEAR(normal, weight * std::cos(slope), 1e-3 * weight);
    EXPECT_NEAR(tangential, holds ? weight * std::sin(slope) : friction * normal, 1e-3 * weight);
    EXPECT_NEAR(sliding / normal, holds ? 0 : 1, 1e-9) << "holds, or slides";
    sim.remove(jelly);
    sim.remove(ground);
  }
}

TEST_P(ContactReport, OfTwoSoftBodiesThatHitIsTheChangeOfTheirMomenta) {
  for (const Real speed : {1.0, 5.0, 30.0, 300.0}) {
    SCOPED_TRACE(speed);
    btSoftBody& left = add_box({-0.6, 0, 0});
    btSoftBody& right = add_box({0, 0.1, 0.2}, 0.3);
    throw_at(left, {speed, 0, 0});
    const Vector3 before = linear_momentum(particles(left));
    Vector3 given = Vector3::Zero(), reaction = Vector3::Zero();
    for (int k = 0; k < 60; ++k) {
      sim.step(frame / std::max<Real>(1, speed));
      given += sum_of(contacts(left));
      reaction += sum_of(contacts(right));
      for (const BodyContact& contact : contacts(left)) EXPECT_EQ(contact.object, &right);
    }
    const Vector3 change = linear_momentum(particles(left)) - before;
    EXPECT_GT(change.norm(), 0.1 * speed) << "did not hit";
    EXPECT_LT((given - change).norm(), limit(1e-12, 1e-6) * speed);
    EXPECT_LT((given + reaction).norm(), 1e-12 * speed);
    sim.remove(left);
    sim.remove(right);
  }
}

// Too few substeps gain energy: the guard takes the step back, and with it what contacts gave.
TEST_P(ContactReport, OfAStepThatIsRepeatedIsThatOfTheLastAttempt) {
  const JellyOptions stiff{.stiffness = 1000, .attach = {.step = {.substeps = 4}}};
  btSoftBody& left = sim.add_jelly(make_box({0.5, 0.5, 0.5}, {4, 4, 4}), stiff);
  JellyOptions beside = stiff;
  beside.shift = {0.56, 0.1, 0.1};
  btSoftBody& right = sim.add_jelly(make_box({0.3, 0.3, 0.3}, {3, 3, 3}), beside);
  btRigidBody& wall = sim.add_box({0.1, 1, 1}, 0, {1.0, 0, 0});
  throw_at(left, {5, 0, 0});
  int retries = 0;
  Real of_wall = 0;
  for (int k = 0; k < 10; ++k) {
    const Vector3 of_left = linear_momentum(particles(left)), of_right = linear_momentum(particles(right));
    sim.step(frame);
    retries += sim.penalty().report(left).retries + sim.penalty().report(right).retries;
    EXPECT_LT((linear_momentum(particles(left)) - of_left - sum_of(contacts(left))).norm(), limit(1e-11, 1e-5)) << k;
    EXPECT_LT((linear_momentum(particles(right)) - of_right - sum_of(contacts(right))).norm(), limit(1e-11, 1e-5)) << k;
    for (const BodyContact& contact : contacts(right))
      if (contact.object == &wall) of_wall += contact.normal_impulse();
  }
  EXPECT_GT(retries, 0);
  EXPECT_GT(of_wall, 0.5);
}

// Until the cloth has wrapped itself around the ball.
TEST_P(ContactReport, OfABallThrownAtAClothIsItsChangeOfMomentum) {
  btSoftBody& cloth = add_cloth(1, 0.01);
  btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.05)), 0.5, {0.55, 0.52, 0.4});
  ball.setLinearVelocity({0, 0, -10});
  Vector3 impulse = Vector3::Zero();
  int first = -1;
  for (int k = 0; k < 6; ++k) {
    const Vector3 before = to_vector(ball.getLinearVelocity()), of_cloth = linear_momentum(particles(cloth));
    sim.step(frame);
    const Vector3 change = 0.5 * (to_vector(ball.getLinearVelocity()) - before);
    const Real step = static_cast<float>(frame);  // what Bullet's classic world makes of it
    const ContactForce force = sim.penalty().contact_force(ball);
    EXPECT_LT((force.force * (GetParam() == WorldKind::classic ? step : frame) - change).norm(), limit(1e-12, 1e-5));
    EXPECT_LT((sum_of(contacts(cloth)) - linear_momentum(particles(cloth)) + of_cloth).norm(), limit(1e-12, 1e-6));
    impulse += change;
    for (const BodyContact& contact : contacts(cloth)) {
      if (first < 0) first = k;
      EXPECT_EQ(contact.object, &ball);
      EXPECT_EQ(contact.is_new, k == first) << "frame " << k;
      const Vector3 arm = contact.point - to_vector(ball.getWorldTransform().getOrigin());
      EXPECT_GT(contact.normal.dot(arm.normalized()), 0.8) << "off the ball, as it was during the step";
      EXPECT_NEAR(arm.norm(), 0.06, 0.01);
    }
  }
  EXPECT_GE(first, 0);
  EXPECT_GT(impulse.z(), 0.5);
}

// So fast that the guard makes the ball and what it hits move as one.
TEST_P(ContactReport, OfAFastBallIsItsChangeOfMomentumToo) {
  btSoftBody& cloth = add_cloth(1, 0.001);
  btRigidBody& ball = sim.add_rigid(std::make_unique<btSphereShape>(btScalar(0.01)), 0.1, {0.55, 0.52, 0.4});
  ball.setLinearVelocity({0, 0, -200});
  Vector3 sum = Vector3::Zero();
  for (int k = 0; k < 4; ++k) {
    sim.step(frame);
    sum -= sum_of(contacts(cloth));
  }
  EXPECT_GT(sum.z(), 0.5);
  const Vector3 of_ball = 0.1 * (to_vector(ball.getLinearVelocity()) + Vector3(0, 0, 200));
  EXPECT_LT((sum - of_ball).norm(), limit(1e-12, 1e-5) * 20);
  EXPECT_LT((sum + linear_momentum(particles(cloth))).norm(), limit(1e-12, 1e-5) * 20);
}

TEST_P(ContactReport, NamesAKinematicMover) {
  btRigidBody& mover = sim.add_box({0.1, 1, 1}, 0, {-0.2, 0.2, 0.2});
  mover.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  btSoftBody& body = add_box({0, 0, 0});
  const Vector3 before = linear_momentum(particles(body));
  Vector3 given = Vector3::Zero();
  for (int k = 1; k <= 60; ++k) {
    mover.setWorldTransform(
        btTransform(btQuaternion(0, 0, 0, 1), to_bullet(Vector3(-0.2 + 0.5 * k * frame, 0.2, 0.2))));
    sim.step(frame);
    given += sum_of(contacts(body));
    for (const BodyContact& contact : contacts(body)) EXPECT_EQ(contact.object, &mover);
  }
  EXPECT_GT(given.x(), 0.4) << "of 1 kg";
  EXPECT_LT((linear_momentum(particles(body)) - before - given).norm(), limit(1e-12, 1e-6));
}

TEST_P(ContactReport, OfAClothThatTouchesItselfNamesItAndAddsUpToNothing) {
  TriangleSurface sheet = make_sheet(1, 1, 12, 12);
  TriangleSurface folded = sheet;
  for (int i = 0; i < folded.vertices.cols(); ++i) {
    const Real y = sheet.vertices(1, i), over = std::max<Real>(y - 0.5, 0);
    folded.vertices.col(i) = Vector3(sheet.vertices(0, i), 1 + std::min<Real>(0.1, over), std::min<Real>(y, 0.5));
    if (over > 0.1) folded.vertices(2, i) = 0.5 - (over - 0.1);
  }
  std::vector<int> pinned;
  for (int i = 0; i < sheet.vertices.cols(); ++i)
    if (sheet.vertices(1, i) <= 0.5) pinned.push_back(i);
  sim.set_gravity({0, -g, 0});
  btSoftBody& cloth = sim.add(make_soft_body(sim.info(), folded, {.mass = 0.2, .pinned = pinned, .margin = 0.01}));
  PotentialField field(sheet.vertices);
  field.add<Length>(edges_of(std::span<const Triangle>(sheet.triangles)), 1);
  field.add<BendingAngle>(hinges_of(sheet.triangles), 1e-5);
  sim.penalty().attach(cloth, std::move(field), {.step = {.damping_time = 0.005}});
  sim.step(frame, 60);
  Real pressed = 0;
  for (const BodyContact& contact : contacts(cloth)) {
    EXPECT_EQ(contact.object, &cloth);
    pressed += contact.normal_impulse();
  }
  EXPECT_GT(pressed, 0);
  EXPECT_LT(sum_of(contacts(cloth)).norm(), 1e-12);
  EXPECT_LT(sim.penalty().contact_force(cloth).force.norm(), 1e-10);
}

TEST_P(ContactReport, HandsOutNoObjectThatHasLeftTheWorld) {
  sim.set_gravity({0, -g, 0});
  sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.02, 0});
  btSoftBody& upper = add_box({0.1, 0.56, 0.1}, 0.3);
  btRigidBody& box = sim.add_box({0.02, 0.1, 0.15}, 0.5, {0.45, 0.66, 0.25});
  const auto count = [&](const btCollisionObject* object) {
    return std::ranges::count(contacts(jelly), object, &BodyContact::object);
  };
  sim.step(frame, 120);
  ASSERT_GT(count(&box), 0);
  ASSERT_GT(count(&upper), 0);
  const Vector3 given = sum_of(contacts(jelly));
  const auto of_box = count(&box), of_upper = count(&upper);
  sim.remove(box);
  EXPECT_EQ(count(&box), 0);  // compared, not followed
  EXPECT_EQ(count(nullptr), of_box);
  sim.remove(upper);
  EXPECT_EQ(count(nullptr), of_box + of_upper);
  EXPECT_EQ(sum_of(contacts(jelly)), given) << "still what held it";
  sim.step(frame);
  EXPECT_EQ(count(nullptr), 0);
  const std::unique_ptr<btSoftBody> taken = sim.take_out(jelly);
  EXPECT_EQ(count(nullptr), static_cast<std::ptrdiff_t>(contacts(*taken).size())) << "in no world";
}

TEST_P(ContactReport, OfABodyThatSleepsIsWhatHoldsIt) {
  sim.set_gravity({0, -g, 0});
  btRigidBody& ground = sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.0199, 0});
  let_sleep(jelly);
  for (int k = 0; k < 1200 && jelly.isActive(); ++k) sim.step(frame);
  ASSERT_FALSE(jelly.isActive());
  sim.step(frame, 10);
  const Real weight = mass_of(particles(jelly)) * g;
  EXPECT_NEAR(sum_of(contacts(jelly)).y() / frame, weight, 0.02 * weight);
  EXPECT_NEAR(sim.penalty().contact_force(ground).force.y(), -weight, 0.02 * weight);
}

TEST_P(ContactReport, OfABodyInTheAirIsEmptyAndSoItIsOfOneThatIsHeld) {
  sim.set_gravity({0, -g, 0});
  btRigidBody& ground = sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.0199, 0});
  EXPECT_TRUE(contacts(jelly).empty()) << "before the first step";
  EXPECT_TRUE(sim.penalty().contact_force(ground).force.isZero(0));
  sim.step(frame, 5);
  EXPECT_FALSE(contacts(jelly).empty());
  throw_at(jelly, {0, 5, 0});
  sim.step(frame, 2);
  EXPECT_TRUE(contacts(jelly).empty()) << "in the air";
  throw_at(jelly, {0, -5, 0});
  for (int k = 0; k < 10 && contacts(jelly).empty(); ++k) sim.step(frame);
  ASSERT_FALSE(contacts(jelly).empty());
  jelly.appendNode(btVector3(0, 0, 0), 1);
  sim.step(frame);
  ASSERT_FALSE(sim.penalty().report(jelly).problem.empty());
  EXPECT_TRUE(contacts(jelly).empty()) << "no step was made";
  EXPECT_THROW(contacts(*make_soft_body(sim.info(), make_box({1, 1, 1}, {1, 1, 1}), SoftBodyOptions{})),
               std::invalid_argument);
}

// Sizes at which margins, weights and substeps are others; on the left a light one that carries a heavy one.
TEST_P(ContactReport, IsTheWeightAtAnySize) {
  sim.set_gravity({0, -g, 0});
  for (const Real size : {0.001, 0.1, 100.0}) {
    SCOPED_TRACE(size);
    const Real margin = 0.04 * size, heavy = 5;
    btRigidBody& ground = sim.add_box({10 * size, size, 10 * size}, 0, {0, -size, 0});
    ground.getCollisionShape()->setMargin(static_cast<btScalar>(margin));
    const TetMesh mesh = make_box({size, size, size}, {3, 3, 3});
    // As stiff as that it sinks in by the same share at every size, and damped by as many of its periods.
    btSoftBody& jelly = sim.add_jelly(mesh, {.stiffness = 20 * g * size,
                                             .shift = {0, margin, 0},
                                             .body = {.mass = 1, .margin = margin, .friction = 1},
                                             .attach = {.step = {.damping_time = 0.05 * std::sqrt(size)}}});
    btRigidBody& box =
        sim.add_box(Vector3(0.3, 0.2, 0.3) * size, heavy, Vector3(0.5, 1.25, 0.5) * size + Vector3(0, 2 * margin, 0));
    box.getCollisionShape()->setMargin(static_cast<btScalar>(margin));
    const Real step = std::min<Real>(frame, 0.05 * std::sqrt(size));
    sim.step(step, 300);
    Vector3 on_box = Vector3::Zero(), on_ground = Vector3::Zero();
    constexpr int frames = 100;
    for (int k = 0; k < frames; ++k) {
      sim.step(step);
      on_box += sim.penalty().contact_force(box).force / frames;
      on_ground += sim.penalty().contact_force(ground).force / frames;
    }
    EXPECT_LT((on_box - Vector3(0, heavy * g, 0)).norm(), 0.01 * heavy * g);
    EXPECT_LT((on_ground + Vector3(0, (1 + heavy) * g, 0)).norm(), 0.01 * heavy * g);
    sim.remove(jelly);
    sim.remove(box);
    sim.remove(ground);
  }
}

INSTANTIATE_TEST_SUITE_P(World, ContactReport, both_worlds(), param_name);

class LinkContactReport : public WorldTest {};

TEST_P(LinkContactReport, NamesTheColliderOfALink) {
  btSoftBody& body = sim.add_jelly(make_box({0.4, 0.4, 0.4}, {4, 4, 4}), {.attach = {.step = {.damping_time = 0.02}}});
  btBoxShape shape(to_bullet(Vector3(0.1, 0.3, 0.3)));
  btMultiBody multibody(0, 1, btVector3(1, 1, 1), false, false);
  multibody.setBaseWorldTransform(btTransform(btQuaternion(0, 0, 0, 1), to_bullet(Vector3(-0.2, 0.2, 0.2))));
  multibody.finalizeMultiDof();
  multibody.setLinearDamping(0);
  multibody.setBaseVel(btVector3(1, 0, 0));
  btMultiBodyLinkCollider collider(&multibody, -1);
  collider.setCollisionShape(&shape);
  collider.setWorldTransform(multibody.getBaseWorldTransform());
  multibody.setBaseCollider(&collider);
  sim.deformable_world().addCollisionObject(&collider);
  sim.deformable_world().addMultiBody(&multibody);
  Vector3 given = Vector3::Zero();
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    given -= sim.penalty().contact_force(collider).force * frame;
    for (const BodyContact& contact : sim.penalty().contacts(body)) EXPECT_EQ(contact.object, &collider);
  }
  EXPECT_GT(given.x(), 0.5);
  EXPECT_LT((given - linear_momentum(sim.penalty().particles(body))).norm(), limit(1e-12, 1e-5));
  sim.deformable_world().removeMultiBody(&multibody);
  sim.deformable_world().removeCollisionObject(&collider);
  EXPECT_TRUE(std::ranges::all_of(sim.penalty().contacts(body), [](const auto& c) { return !c.object; }));
}

INSTANTIATE_TEST_SUITE_P(World, LinkContactReport, deformable_world(), param_name);

}  // namespace
}  // namespace penalty::testing
