// Soft bodies that touch each other and themselves, measured at the particles by tests of their own.
#include "bullet/simulation.h"

#include <numeric>

#include "contact/crossings.h"
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/length.h"
#include "penalty/mesh/embed.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {
namespace {

class SoftContact : public WorldTest {
 protected:
  btSoftBody& add_jelly(const TetMesh& mesh, const JellyOptions& options) {
    btSoftBody& body = sim.add_jelly(mesh, options);
    skins_.push_back({&sim.penalty().particles(body).positions, boundary_faces(mesh.tetrahedra)});
    return body;
  }

  btSoftBody& add_cloth(const TriangleSurface& rest, const Eigen::Matrix3Xd& positions, const SoftBodyOptions& options,
                        const AttachOptions& attach = {}) {
    TriangleSurface placed = rest;
    placed.vertices = positions;
    btSoftBody& body = sim.add(make_soft_body(sim.info(), placed, options));
    PotentialField field(rest.vertices);
    field.add<Length>(edges_of(std::span<const Triangle>(rest.triangles)), 1);
    field.add<BendingAngle>(hinges_of(rest.triangles), 1e-5);
    sim.penalty().attach(body, std::move(field), attach);
    skins_.push_back({&sim.penalty().particles(body).positions, rest.triangles});
    return body;
  }

  // The lower half is pinned at a height of 1 m; the upper half, folded over 0.1 m above it, falls on it.
  btSoftBody& add_folded_cloth(const AttachOptions& attach) {
    const TriangleSurface sheet = make_sheet(1, 1, 12, 12);
    sim.set_gravity({0, -10, 0});
    Eigen::Matrix3Xd positions = sheet.vertices;
    std::vector<int> pinned;
    for (int i = 0; i < positions.cols(); ++i) {
      const Real y = sheet.vertices(1, i), over = std::max<Real>(y - 0.5, 0);
      positions.col(i) = Vector3(sheet.vertices(0, i), 1 + std::min<Real>(0.1, over), std::min<Real>(y, 0.5));
      if (over > 0.1) positions(2, i) = 0.5 - (over - 0.1);
      if (y <= 0.5) pinned.push_back(i);
    }
    return add_cloth(sheet, positions, {.mass = 0.2, .pinned = pinned, .margin = 0.01}, attach);
  }

  // A ball of soft stuff above another, 2 cm apart, the lower one pinned.
  std::array<btSoftBody*, 2> add_ball_over_ball() {
    const TetMesh ball = make_ball(0.3, 2);
    sim.set_gravity({0, -10, 0});
    std::vector<int> all(ball.vertices.cols());
    std::iota(all.begin(), all.end(), 0);
    btSoftBody& lower = add_jelly(ball, {.body = {.pinned = all}});
    btSoftBody& upper = add_jelly(ball, {.shift = {0.02, 0.64, 0.01}, .attach = {.step = {.damping_time = 0.01}}});
    return {&lower, &upper};
  }

  // Steps; nothing may cross, in any frame. The highest energy of all [J].
  Real watch(int steps) {
    Real highest = 0;
    for (int k = 0; k < steps && !HasFailure(); ++k) {
      sim.step(frame);
      EXPECT_EQ(count_crossings(skins_), 0) << "frame " << k;
      highest = std::max(highest, sim.totals().energy);
    }
    return highest;
  }

  std::vector<Skin> skins_;
};

TEST_P(SoftContact, TwoToriThatHitEachOtherDoNotCrossAndKeepTheirMomenta) {
  const TetMesh torus = make_torus(0.7, 0.3, 2, 18);
  for (const Real speed : {5.0, 50.0}) {
    SCOPED_TRACE(speed);
    skins_.clear();
    const auto throw_torus = [&](const Vector3& shift, const Vector3& velocity) {
      btSoftBody& body = sim.add_jelly(torus, {.shift = shift, .attach = {.step = {.damping_time = 0.002}}});
      skins_.push_back({&sim.penalty().particles(body).positions, boundary_faces(torus.tetrahedra)});
      for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = to_bullet(velocity);
      sim.penalty().synchronize(body);
      return &body;
    };
    const std::array bodies{throw_torus({-1.2, 0, 0}, {speed / 2, 0, 0}),
                            throw_torus({1.2, 0.2, 0.3}, {-speed / 2, 0, 0})};
    const Totals start = sim.totals();
    EXPECT_LE(watch(speed > 10 ? 12 : 40), (1 + 1e-12) * start.energy);
    const Totals end = sim.totals();
    const Real scale = speed;  // 1 kg each
    EXPECT_LT((end.momentum - start.momentum).norm(), 1e-12 * scale);
    EXPECT_LT((end.angular_momentum - start.angular_momentum).norm(), 1e-12 * scale);
    EXPECT_LT(end.energy, 0.95 * start.energy) << "did not hit";
    for (btSoftBody* body : bodies) sim.remove(*body);
  }
}

TEST_P(SoftContact, ASoftBoxRestsOnASoftBoxOnTheGround) {
  const TetMesh box = make_box({0.5, 0.5, 0.5}, {4, 4, 4});
  sim.add_ground();
  sim.set_gravity({0, -10, 0});
  const AttachOptions damped{.step = {.damping_time = 0.05}};
  add_jelly(box, {.stiffness = 20, .shift = {0, 0.03, 0}, .attach = damped});
  btSoftBody& upper = add_jelly(box, {.stiffness = 20, .shift = {0.05, 0.56, 0.05}, .attach = damped});
  watch(180);
  const Particles& particles = sim.penalty().particles(upper);
  EXPECT_LT(kinetic_energy(particles), 1e-3);
  EXPECT_GT(lowest(upper), 0.5);
  EXPECT_LT(lowest(upper), 0.55);
  EXPECT_GT(least_distance(skins_, false), 0.019);  // margins of 0.02
}

TEST_P(SoftContact, AFoldedClothLiesOnItself) {
  btSoftBody& cloth = add_folded_cloth({.step = {.damping_time = 0.005}});
  watch(90);
  EXPECT_GT(lowest(cloth), 0.999);
  EXPECT_LT(kinetic_energy(sim.penalty().particles(cloth)), 1e-4);
}

TEST_P(SoftContact, ThatIsSwitchedOffLetsAClothFallThroughItself) {
  btSoftBody& cloth = add_folded_cloth({.step = {.damping_time = 0.005}, .self_contact = false});
  sim.step(frame, 60);
  EXPECT_LT(lowest(cloth), 0.8);
}

TEST_P(SoftContact, ABodyWhoseNodesAreAllPinnedCarriesAnother) {
  btSoftBody& upper = *add_ball_over_ball()[1];
  watch(40);  // then it rolls off
  EXPECT_GT(lowest(upper), 0.2);
  EXPECT_GT(sim.penalty().report(upper).num_contacts, 0);
}

TEST_P(SoftContact, AsksBulletsFilters) {
  const auto falls_after = [&](const auto& separate) {
    skins_.clear();
    const auto [lower, upper] = add_ball_over_ball();
    separate(*lower, *upper);
    sim.step(frame, 40);
    const bool fell = lowest(*upper) < 0;
    sim.remove(*lower);
    sim.remove(*upper);
    return fell;
  };
  EXPECT_FALSE(falls_after([](btSoftBody&, btSoftBody&) {}));
  EXPECT_TRUE(falls_after([](btSoftBody& lower, btSoftBody&) {
    lower.getBroadphaseHandle()->m_collisionFilterGroup = 64;
    lower.getBroadphaseHandle()->m_collisionFilterMask = 64;
  }));
  EXPECT_TRUE(falls_after([](btSoftBody& lower, btSoftBody& upper) { upper.setIgnoreCollisionCheck(&lower, true); }));
  EXPECT_TRUE(falls_after([](btSoftBody& lower, btSoftBody& upper) { lower.setIgnoreCollisionCheck(&upper, true); }));
  EXPECT_TRUE(
      falls_after([](btSoftBody& lower, btSoftBody& upper) { upper.m_collisionDisabledObjects.push_back(&lower); }));
  EXPECT_TRUE(falls_after([](btSoftBody& lower, btSoftBody&) {
    lower.setCollisionFlags(lower.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }));
}

TEST_P(SoftContact, IsWhatBulletsFlagsMean) {
  // Flags that ask Bullet for contact of its own change nothing: it is there already.
  const auto height_with = [&](int flags) {
    skins_.clear();
    const auto [lower, upper] = add_ball_over_ball();
    for (btSoftBody* body : {lower, upper}) body->m_cfg.collisions |= flags;
    sim.step(frame, 20);
    const Real height = lowest(*upper);
    sim.remove(*lower);
    sim.remove(*upper);
    return height;
  };
  const Real without = height_with(0);
  EXPECT_EQ(height_with(btSoftBody::fCollision::VF_SS), without);
  EXPECT_EQ(height_with(btSoftBody::fCollision::VF_DD), without);
}

TEST_P(SoftContact, ARopeHangsOverARope) {
  // No faces: links touch. Two ropes cross; one is pinned at its ends, the other falls across it.
  sim.set_gravity({0, -10, 0});
  const auto add_rope = [&](const Vector3& from, const Vector3& to, bool pinned) -> btSoftBody& {
    constexpr int count = 11;
    btAlignedObjectArray<btVector3> positions;
    btAlignedObjectArray<btScalar> masses;
    Eigen::Matrix3Xd rest(3, count);
    for (int i = 0; i < count; ++i) {
      rest.col(i) = from + (to - from) * i / (count - 1);
      positions.push_back(to_bullet(Vector3(rest.col(i))));
      masses.push_back(pinned && (i == 0 || i == count - 1) ? btScalar(0) : btScalar(0.01));
    }
    auto rope = std::make_unique<btSoftBody>(&sim.info(), count, &positions[0], &masses[0]);
    PotentialField field(rest);
    std::vector<Edge> edges;
    for (int i = 0; i + 1 < count; ++i) {
      rope->appendLink(i, i + 1);
      edges.push_back({i, i + 1});
    }
    field.add<Length>(edges, 5);
    rope->getCollisionShape()->setMargin(btScalar(0.01));
    btSoftBody& added = sim.add(std::move(rope));
    sim.penalty().attach(added, std::move(field), {.step = {.damping_time = 0.01, .drag = 1}});
    return added;
  };
  btSoftBody& held = add_rope({-0.5, 1, 0}, {0.5, 1, 0}, true);
  btSoftBody& thrown = add_rope({0.02, 1.05, -0.5}, {0.02, 1.05, 0.5}, false);
  for (int k = 0; k < 60; ++k) {
    sim.step(frame);
    const Real middle_of_thrown = Real(thrown.m_nodes[5].m_x.y()), middle_of_held = Real(held.m_nodes[5].m_x.y());
    ASSERT_GT(middle_of_thrown, middle_of_held) << "frame " << k;
  }
  EXPECT_LT(Real(thrown.m_nodes[0].m_x.y()), 0.9) << "its ends hang down";
}

TEST_P(SoftContact, EmbeddedSurfacesTouchWithTheirOwnTriangles) {
  // Spheres in coarse lattices, one on the other in a shaft of their own: the lattices overlap, the spheres do not.
  const TriangleSurface sphere = make_sphere(0.3, 6);
  const EmbeddedSurface embedded = embed(sphere, {.cells = 3});
  sim.set_gravity({0, -10, 0});
  std::vector<btSoftBody*> bodies;
  for (const Real height : {0.0, 0.64}) {
    std::vector<int> pinned;
    if (height == 0)
      for (int i = 0; i < embedded.lattice.vertices.cols(); ++i) pinned.push_back(i);
    btSoftBody& body = sim.add(
        make_soft_body(sim.info(), moved(embedded.lattice, {0, height, 0}), {.pinned = pinned, .margin = 0.02}));
    sim.penalty().attach(body, make_elastic_field(embedded.lattice.vertices, embedded.lattice.tetrahedra, 50.0),
                         {.step = {.damping_time = 0.02}, .surface = BodySurface::of(embedded)});
    bodies.push_back(&body);
  }
  Real least = 1;
  for (int k = 0; k < 30; ++k) {
    sim.step(frame);
    const auto at = [&](int b) {
      return skin(embedded, Eigen::Matrix3Xd(sim.penalty().particles(*bodies[b]).positions.topRows<3>()));
    };
    const std::array<PackedVectors, 2> positions{pack(at(0)), pack(at(1))};
    const std::array<Skin, 2> skins{Skin{&positions[0], sphere.triangles}, Skin{&positions[1], sphere.triangles}};
    ASSERT_EQ(count_crossings(skins), 0) << "frame " << k;
    least = std::min(least, least_distance(skins, false));
  }
  EXPECT_GT(least, 0.018);
  EXPECT_LT(least, 0.03) << "did not touch";
}

TEST_P(SoftContact, BodiesMayComeAndGo) {
  auto [lower, upper] = add_ball_over_ball();
  sim.step(frame, 10);
  sim.remove(*lower);
  skins_.clear();
  sim.step(frame, 30);
  EXPECT_LT(lowest(*upper), 0) << "falls free";
  const auto [third, fourth] = add_ball_over_ball();
  sim.step(frame, 10);
  const std::unique_ptr<btSoftBody> out = sim.take_out(*upper);
  sim.step(frame, 10);
  EXPECT_GT(lowest(*fourth), 0.2) << "still carried";
  sim.penalty().detach(*third);
  sim.step(frame, 30);
  EXPECT_LT(lowest(*fourth), 0) << "by nobody now";
}

INSTANTIATE_TEST_SUITE_P(Worlds, SoftContact, both_worlds(), param_name);

class SleepingInContact : public SoftContact {};

TEST_P(SleepingInContact, BodiesThatTouchFallAsleepTogetherAndWakeTogether) {
  sim.add_ground();
  const TetMesh box = make_box({0.4, 0.4, 0.4}, {2, 2, 2});
  sim.set_gravity({0, -10, 0});
  const AttachOptions damped{.step = {.damping_time = 0.05, .drag = 2}};
  btSoftBody& lower = add_jelly(box, {.stiffness = 50, .shift = {0, 0.021, 0}, .attach = damped});
  btSoftBody& upper = add_jelly(box, {.stiffness = 50, .shift = {0.02, 0.445, 0.02}, .attach = damped});
  let_sleep(lower);
  let_sleep(upper);
  int asleep_alone = 0, frames = 0;
  while (frames < 600 && (lower.isActive() || upper.isActive())) {
    sim.step(frame);
    ++frames;
    asleep_alone += lower.isActive() != upper.isActive();
  }
  EXPECT_LT(frames, 600) << "never slept";
  EXPECT_LE(asleep_alone, 1);
  btSoftBody& third = add_jelly(box, {.stiffness = 50, .shift = {0, 1.1, 0}, .attach = damped});
  sim.step(frame, 40);
  EXPECT_TRUE(upper.isActive() && lower.isActive());
  EXPECT_GT(lowest(third), 0.7);
}

TEST_P(SleepingInContact, ASleeperFallsWhenTheOneBelowItGoes) {
  const auto [lower, upper] = add_ball_over_ball();  // the lower one is pinned
  sim.step(frame, 3);
  for (btSoftBody* body : {lower, upper}) body->forceActivationState(ISLAND_SLEEPING);
  sim.step(frame, 3);
  ASSERT_FALSE(upper->isActive());
  const Real height = lowest(*upper);
  sim.remove(*lower);
  sim.step(frame, 30);
  EXPECT_LT(lowest(*upper), height - 0.5);
}

TEST_P(SleepingInContact, WhatIsThrownAtASleeperHitsIt) {
  // The application throws it between two steps: 0.5 m in one.
  const TetMesh box = make_box({0.4, 0.4, 0.4}, {2, 2, 2});
  btSoftBody& sleeper = add_jelly(box, {.attach = {.step = {.damping_time = 0.01}}});
  btSoftBody& thrown = add_jelly(box, {.shift = {-0.8, 0.1, 0.1}});
  let_sleep(sleeper);
  sim.step(frame);
  sleeper.forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < thrown.m_nodes.size(); ++i) thrown.m_nodes[i].m_v = btVector3(30, 0, 0);
  watch(20);
  EXPECT_TRUE(sleeper.isActive());
  EXPECT_GT(center_of_mass(sim.penalty().particles(sleeper)).x(), 1);
}

INSTANTIATE_TEST_SUITE_P(Worlds, SleepingInContact, deformable_world(), param_name);

class DeepStart : public WorldTest {};

TEST_P(DeepStart, AgainstWhatCannotMoveCostsNoSubsteps) {
  const TetMesh box = make_box({0.5, 0.5, 0.5}, {4, 4, 4});
  const auto most_substeps = [&](Real height, Real lift) {
    Simulation other(GetParam());
    other.set_gravity({0, -10, 0});
    btRigidBody& ground = other.add_ground();
    btSoftBody& body = other.add_jelly(box, {.shift = {0, height, 0}, .attach = {.step = {.damping_time = 0.002}}});
    if (lift > 0) {
      other.step(frame, 60);
      btTransform transform = ground.getWorldTransform();
      transform.getOrigin() += btVector3(0, static_cast<btScalar>(lift), 0);
      ground.setWorldTransform(transform);
    }
    int most = 0;
    for (int k = 0; k < 120; ++k) {
      other.step(frame);
      most = std::max(most, other.penalty().report(body).substeps);
    }
    EXPECT_GT(lowest(body), 0.019 + lift);
    EXPECT_LT(lowest(body), 0.06 + lift);
    return most;
  };
  const int at_rest = most_substeps(0.0201, 0);
  for (const Real depth : {0.0005, 0.001, 0.005, 0.01, 0.02, 0.05})
    EXPECT_LE(most_substeps(0.02 - depth, 0), 2 * at_rest) << depth << " m below the margin";
  for (const Real lift : {0.001, 0.01, 0.05, 0.15})
    EXPECT_LE(most_substeps(0.0201, lift), 2 * at_rest) << "the ground comes up by " << lift << " m";
}

INSTANTIATE_TEST_SUITE_P(Worlds, DeepStart, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
