// Bodies that are moved, taken out and put in again, and worlds beside each other.
#include <algorithm>
#include <array>
#include <numbers>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

constexpr Real exact_g = 9.75;

class Worlds : public WorldTest {
 protected:
  void SetUp() override { sim.set_gravity({0, -exact_g, 0}); }
  Vector3 center(const btSoftBody& body) { return center_of_mass(sim.penalty().particles(body)); }
};

TEST_P(Worlds, ABodyThatIsTranslatedGoesOnFromThere) {
  Simulation other(GetParam());
  other.set_gravity({0, -exact_g, 0});
  btSoftBody& body = sim.add_jelly(make_ball(0.5, 2));
  btSoftBody& stays = other.add_jelly(make_ball(0.5, 2));
  const btVector3 shift(64, 16, -8);
  for (int k = 0; k < 40; ++k) {
    if (k == 20) body.translate(shift);
    sim.step(exact_frame);
    other.step(exact_frame);
  }
  const Particles &a = sim.penalty().particles(body), &b = other.penalty().particles(stays);
  EXPECT_LT((a.velocities - b.velocities).norm(), limit(1e-10, 1e-3));
  for (int i = 0; i < a.size(); ++i)
    EXPECT_LT((a.positions.col(i).head<3>() - b.positions.col(i).head<3>() - to_vector(shift)).norm(),
              limit(1e-10, 1e-4));
}

TEST_P(Worlds, ABodyThatIsLiftedOffTheGroundFallsAsOneThatNeverLay) {
  sim.add_ground();
  btSoftBody& body =
      sim.add_jelly(make_box({0.4, 0.4, 0.4}, {2, 2, 2}),
                    {.stiffness = 100, .shift = {0, 0.021, 0}, .attach = {.step = {.damping_time = 0.01}}});
  sim.step(exact_frame, 90);
  ASSERT_FALSE(sim.penalty().contacts(body).empty());
  const Real y = center(body).y();
  body.translate(btVector3(1, 4, 2));
  sim.step(exact_frame, 32);
  EXPECT_TRUE(sim.penalty().contacts(body).empty());
  EXPECT_NEAR(center(body).y(), y + 4 - exact_g * 0.25 / 2, 2e-3);
  sim.step(exact_frame, 160);
  EXPECT_NEAR(center(body).y(), y, 1e-3) << "lies again, elsewhere";
}

// Node velocities stay what they are, as in stock Bullet.
TEST_P(Worlds, ABodyThatIsRotatedOrTransformedIsNotStrained) {
  sim.set_gravity({0, 0, 0});
  btSoftBody& body = sim.add_jelly(make_box({1, 0.5, 0.3}, {4, 2, 2}));
  body.setVelocity(btVector3(1, 0, 0));
  sim.step(exact_frame, 8);
  body.rotate(btQuaternion(btVector3(0, 0, 1), static_cast<btScalar>(std::numbers::pi / 2)));
  sim.step(exact_frame);
  const Particles& particles = sim.penalty().particles(body);
  const auto extent = [&](int axis) {
    return particles.positions.row(axis).maxCoeff() - particles.positions.row(axis).minCoeff();
  };
  EXPECT_NEAR(extent(0), 0.5, 1e-4);
  EXPECT_NEAR(extent(1), 1, 1e-4);
  EXPECT_LT(sim.penalty().field(body).energy(particles.positions), limit(1e-20, 1e-6));
  body.transform(btTransform(btQuaternion(btVector3(1, 1, 0).normalized(), 2), btVector3(3, -2, 5)));
  sim.step(exact_frame, 8);
  EXPECT_LT(sim.penalty().field(body).energy(particles.positions), limit(1e-20, 1e-6));
  EXPECT_LT((particles.velocities.colwise() - Eigen::Vector4d(1, 0, 0, 0)).norm(), limit(1e-9, 1e-2));
}

// Bullet makes the new size that of rest, in its links; a field knows its own.
TEST_P(Worlds, ABodyThatIsScaledComesBackToTheSizeOfItsField) {
  sim.set_gravity({0, 0, 0});
  btSoftBody& body =
      sim.add_jelly(make_box({1, 1, 1}, {3, 3, 3}), {.stiffness = 1000, .attach = {.step = {.damping_time = 0.01}}});
  body.scale(btVector3(btScalar(1.2), btScalar(1.2), btScalar(1.2)));
  sim.penalty().synchronize(body);
  const PackedVectors& x = sim.penalty().particles(body).positions;
  const auto height = [&] { return x.row(1).maxCoeff() - x.row(1).minCoeff(); };
  EXPECT_NEAR(height(), 1.2, 1e-6);
  EXPECT_GT(sim.penalty().field(body).energy(x), 0.1);
  sim.step(exact_frame, 128);
  EXPECT_NEAR(height(), 1, 1e-3);
}

TEST_P(Worlds, BesideEachOtherKnowNothingOfEachOther) {
  const auto build = [](Simulation& s, Real stiffness) -> btSoftBody& {
    s.set_gravity({0, -exact_g, 0});
    s.add_ground();
    s.add_box({0.1, 0.1, 0.1}, 1, {0.1, 1.2, 0.1});
    return s.add_jelly(make_box({0.4, 0.4, 0.4}, {2, 2, 2}), {.stiffness = stiffness, .shift = {0, 0.3, 0}});
  };
  Simulation here(GetParam()), there(GetParam()), alone(GetParam());
  btSoftBody &a = build(here, 10), &b = build(there, 40), &c = build(alone, 10);
  for (int k = 0; k < 90; ++k) {
    here.step(exact_frame);
    there.step(exact_frame);
    alone.step(exact_frame);
  }
  EXPECT_EQ(here.penalty().particles(a).positions, alone.penalty().particles(c).positions);
  EXPECT_NE(there.penalty().particles(b).positions, alone.penalty().particles(c).positions);
}

// What Bullet asks of who moves a soft body to another world: that it gets the other's info.
TEST_P(Worlds, MayExchangeTheirBodies) {
  Simulation other(GetParam());
  other.add_box({2, 0.1, 2}, 0, {0, -4, 0});
  const TetMesh ball = make_ball(0.25, 2);
  btSoftBody* falls = &sim.add_jelly(ball);
  btSoftBody* floats = &other.add_jelly(ball, {.shift = {5, 0, 0}});
  sim.step(exact_frame, 32);
  other.step(exact_frame, 32);
  const Real fallen = -exact_g * 0.25 / 2, speed = -exact_g / 2;
  EXPECT_NEAR(center(*falls).y(), fallen, 1e-4);
  for (const bool detaches : {true, false}) {
    if (detaches) {
      sim.penalty().detach(*falls);
      other.penalty().detach(*floats);
    }
    std::unique_ptr<btSoftBody> one = sim.take_out(*falls), two = other.take_out(*floats);
    one->m_worldInfo = &other.info();
    two->m_worldInfo = &sim.info();
    falls = &other.add(std::move(one));
    floats = &sim.add(std::move(two));
    other.penalty().attach(*falls, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
    sim.penalty().attach(*floats, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
    if (detaches) {
      sim.step(exact_frame, 16);
      other.step(exact_frame, 16);
      EXPECT_NEAR(center_of_mass(other.penalty().particles(*falls)).y(), fallen + speed / 4, 1e-3) << "no gravity here";
      EXPECT_NEAR(center(*floats).y(), -exact_g / 32, 1e-3);
      // And back.
      one = other.take_out(*falls);
      two = sim.take_out(*floats);
      one->m_worldInfo = &sim.info();
      two->m_worldInfo = &other.info();
      falls = &sim.add(std::move(one));
      floats = &other.add(std::move(two));
      sim.penalty().attach(*falls, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
      other.penalty().attach(*floats, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
    }
  }
  other.step(exact_frame, 128);
  EXPECT_GT(lowest(*falls), -4 + 0.09) << "there is a box";
  EXPECT_TRUE(sim.penalty().report(*floats).problem.empty());
}

// A pile of three soft boxes with a rigid one between them.
TEST_P(Worlds, BodiesThatTouchCanBeRemovedInAnyOrder) {
  std::array<int, 4> order{0, 1, 2, 3};
  do {
    Simulation own(GetParam());
    own.set_gravity({0, -exact_g, 0});
    own.add_ground();
    const TetMesh box = make_box({0.4, 0.2, 0.4}, {2, 1, 2});
    std::array<btSoftBody*, 3> soft{};
    for (int k = 0; k < 3; ++k)
      soft[k] = &own.add_jelly(box, {.stiffness = 20,
                                     .shift = {0, 0.021 + 0.241 * k + (k > 1 ? 0.13 : 0), 0},
                                     .attach = {.step = {.damping_time = 0.01}}});
    btRigidBody& plate = own.add_box({0.2, 0.04, 0.2}, 0.5, {0.2, 0.565, 0.2});
    own.step(exact_frame, 16);
    ASSERT_FALSE(own.penalty().contacts(*soft[1]).empty());
    for (const int k : order) {
      if (k == 3)
        own.remove(plate);
      else
        own.remove(*std::exchange(soft[k], nullptr));
      own.step(exact_frame, 2);
      for (const btSoftBody* body : soft)
        if (body) {
          ASSERT_TRUE(own.penalty().particles(*body).positions.allFinite());
          ASSERT_TRUE(own.penalty().report(*body).problem.empty());
          ASSERT_GT(lowest(*body), 0.01);
        }
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST_P(Worlds, ABodyIsPutBackWhereverAndWheneverOneLikes) {
  sim.add_ground();
  btSoftBody* body =
      &sim.add_jelly(make_box({0.4, 0.4, 0.4}, {2, 2, 2}),
                     {.stiffness = 100, .shift = {0, 0.3, 0}, .attach = {.step = {.damping_time = 0.01}}});
  for (int k = 0; k < 10; ++k) {
    sim.step(exact_frame, 3);
    std::unique_ptr<btSoftBody> taken = sim.take_out(*body);
    if (k % 2 == 1) sim.step(exact_frame, 2);
    if (k % 3 == 1) taken->translate(btVector3(1, btScalar(0.1), 0));
    body = &sim.add(std::move(taken));
  }
  sim.step(exact_frame, 128);
  EXPECT_NEAR(lowest(*body), 0.02, 2e-3);
  EXPECT_NEAR(center(*body).x(), 3.2, 0.01);
  EXPECT_TRUE(sim.penalty().report(*body).problem.empty());
}

INSTANTIATE_TEST_SUITE_P(World, Worlds, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
