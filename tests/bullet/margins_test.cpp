// Margins of any size on bodies of any size.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <algorithm>
#include <cmath>

#include "bullet/simulation.h"

namespace penalty::testing {
namespace {

// Sizes [m], and stiffness and mass such that all of them bend alike under their weight.
class Margins : public WorldTest {
 protected:
  void SetUp() override { sim.set_gravity({0, -g, 0}); }

  btSoftBody& add_box(Real size, Real margin, const Vector3& place) {
    const Real mass = 100 * size * size * size;
    return sim.add_jelly(make_box({size, size / 2, size}, {6, 3, 6}),
                         {.stiffness = 0.1 * mass * g * size,
                          .shift = size * place,
                          .body = {.mass = mass, .margin = margin, .friction = 1},
                          .attach = {.step = {.damping_time = 0.02}}});
  }
  int substeps(const btSoftBody& body) { return sim.penalty().report(body).substeps; }
};

// The corners of a pillar come up between the nodes, the box on top has eight of its own.
TEST_P(Margins, NoneCostsNoMoreSubstepsThanAFewCloseSurfacesTake) {
  sim.add_box({10, 0.5, 10}, 0, {0, -0.5, 0});
  sim.add_box({0.23, 0.2, 0.23}, 0, {0.5, 0.2, 0.5});
  const btSoftBody& body = add_box(1, 0, {0, 0.5, 0});
  const btRigidBody& box = sim.add_box({0.13, 0.1, 0.13}, 5, {0.5, 1.2, 0.5});
  int most = 0;
  for (int k = 0; k < 90; ++k) {
    sim.step(frame);
    most = std::max(most, substeps(body));
  }
  EXPECT_LE(most, 80);
  EXPECT_GT(lowest(body), -1e-3);
  EXPECT_GT(Real(box.getWorldTransform().getOrigin().y()), 0.5) << "held";
}

// What Bullet's helpers leave on a body, and more.
TEST_P(Margins, OnesLargerThanTheBodyDoNotWreckIt) {
  for (const Real size : {0.01, 0.1, 1.0})
    for (const Real margin : {0.04, 0.25, 1.0}) {
      SCOPED_TRACE("size " + std::to_string(size) + ", margin " + std::to_string(margin));
      Simulation own(GetParam());
      own.set_gravity({0, -g, 0});
      own.add_box({10 * size, size, 10 * size}, 0, {0, -size, 0});
      const Real mass = 100 * size * size * size;
      const TetMesh mesh = moved(make_box({size, size / 2, size}, {6, 3, 6}), {0, 0.02 * size, 0});
      btSoftBody& body = own.add_jelly(mesh, {.stiffness = 0.1 * mass * g * size,
                                              .body = {.mass = mass, .margin = margin, .friction = 1},
                                              .attach = {.step = {.damping_time = 0.02}}});
      btRigidBody& box = own.add_box(0.1 * Vector3(size, size, size), mass / 10, {size / 2, 0.65 * size, size / 2});
      Real fastest = 0;
      for (int k = 0; k < 90; ++k) {
        own.step(frame);
        for (int i = 0; i < body.m_nodes.size(); ++i) fastest = std::max(fastest, Real(body.m_nodes[i].m_v.length()));
        EXPECT_LE(own.penalty().report(body).substeps, 60) << k;
      }
      EXPECT_LT(fastest, 12 * size + 0.1) << "pushed out of the margins, not blown up";
      EXPECT_LT(mean_volume_error(own.penalty(), body), 0.25);
      EXPECT_LT(lowest(body), 0.45 * size) << "no further off than the size of the body allows";
      EXPECT_LT(std::abs(Real(box.getWorldTransform().getOrigin().x()) - size / 2), 0.5 * size) << "still on it";
      EXPECT_GT(Real(box.getWorldTransform().getOrigin().y()), size / 2);
    }
}

TEST_P(Margins, OnesLargerThanTheBodyAllowsAreNamedByAttach) {
  const TetMesh mesh = make_box({0.01, 0.01, 0.01}, {2, 2, 2});
  btSoftBody& body = sim.add(make_soft_body(sim.info(), mesh, {.margin = 0.25}));
  const auto unused = sim.penalty().attach(body, PotentialField(mesh.vertices)).unused_settings();
  ASSERT_EQ(unused.size(), 1u);
  EXPECT_EQ(unused[0].find("the collision margin is 0.25, more than a quarter of the size of the body: 0.0043301"), 0u)
      << unused[0];
}

INSTANTIATE_TEST_SUITE_P(World, Margins, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
