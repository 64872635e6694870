// Bodies that come and go, several fields, and bodies that the application made itself.
#include "bullet/simulation.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

namespace penalty::testing {
namespace {

class Attaching : public WorldTest {
 protected:
  // A ball with something to do: one node is pulled out.
  static btSoftBody& add_plucked_ball(Simulation& simulation, const Vector3& at) {
    btSoftBody& body = simulation.add_jelly(make_ball(0.25, 2), {.shift = at});
    body.m_nodes[20].m_x += btVector3(btScalar(0.0625), 0, 0);
    return body;
  }
};

TEST_P(Attaching, BodiesThatComeAndGoDoNotDisturbTheOthers) {
  Simulation alone(GetParam());
  sim.set_gravity({0, -9.75, 0});
  alone.set_gravity({0, -9.75, 0});
  btSoftBody* first = &add_plucked_ball(sim, {-5, 0, 0});
  btSoftBody& watched = add_plucked_ball(sim, {0, 0, 0});
  btSoftBody& reference = add_plucked_ball(alone, {0, 0, 0});
  btSoftBody* third = nullptr;
  for (int step = 0; step < 40; ++step) {
    if (step == 10) sim.remove(*first);  // the nodes of all others are numbered anew
    if (step == 15) third = &add_plucked_ball(sim, {5, 0, 0});
    if (step == 20) first = &add_plucked_ball(sim, {-5, 2, 0});
    if (step == 30) sim.remove(*third);
    sim.step(exact_frame);
    alone.step(exact_frame);
    ASSERT_EQ(sim.penalty().particles(watched).positions, alone.penalty().particles(reference).positions) << step;
  }
  EXPECT_LT(center_of_mass(sim.penalty().particles(watched)).y(), -1);
}

TEST_P(Attaching, WorksBeforeTheBodyIsInTheWorld) {
  sim.set_gravity({0, -9.75, 0});
  const TetMesh ball = make_ball(0.25, 2);
  auto made = make_soft_body(sim.info(), ball);
  sim.penalty().attach(*made, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
  sim.step(exact_frame, 3);
  EXPECT_EQ(made->m_nodes[0].m_x.y(), btScalar(ball.vertices(1, 0))) << "not yet in the world";
  btSoftBody& body = sim.add(std::move(made));
  sim.step(exact_frame, 16);
  EXPECT_NEAR(Real(body.m_nodes[0].m_x.y()), ball.vertices(1, 0) - 9.75 / 16 / 2, 1e-5);
}

TEST_P(Attaching, ABodyTakenOutOfTheWorldWaits) {
  btSoftBody* body = &add_plucked_ball(sim, {0, 0, 0});
  sim.step(exact_frame, 10);
  const Particles before = sim.penalty().particles(*body);
  std::unique_ptr<btSoftBody> taken = sim.take_out(*body);
  sim.step(exact_frame, 10);
  EXPECT_EQ(sim.penalty().particles(*taken).positions, before.positions);
  body = &sim.add(std::move(taken));
  sim.step(exact_frame, 10);
  EXPECT_NE(sim.penalty().particles(*body).positions, before.positions);
  EXPECT_TRUE(sim.penalty().particles(*body).positions.allFinite());
}

TEST_P(Attaching, DetachingGivesTheBodyBackToBullet) {
  btSoftBody& body = sim.add_jelly(make_ball(0.25, 2));
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = btVector3(1, 2, 3);
  sim.step(exact_frame, 10);
  ASSERT_TRUE(sim.penalty().is_attached(body));
  sim.penalty().detach(body);
  EXPECT_FALSE(sim.penalty().is_attached(body));
  sim.penalty().detach(body);  // twice does nothing
  const Vector3 before = to_vector(body.m_nodes[7].m_x);
  sim.step(exact_frame, 16);  // of free nodes, without forces
  EXPECT_LT((to_vector(body.m_nodes[7].m_x) - before - Vector3(1, 2, 3) / 4).norm(), 1e-5);
  EXPECT_LT((to_vector(body.m_nodes[7].m_v) - Vector3(1, 2, 3)).norm(), 1e-5);

  body.m_nodes[7].m_x += btVector3(btScalar(0.03125), 0, 0);
  const TetMesh ball = make_ball(0.25, 2);
  sim.penalty().attach(body, make_elastic_field(ball.vertices, ball.tetrahedra, 10.0), {.step = {.drag = 5}});
  sim.step(exact_frame, 200);
  EXPECT_LT(mean_volume_error(sim.penalty(), body), 1e-3) << "attached again";
}

TEST_P(Attaching, AFurtherFieldAddsToTheFirst) {
  Simulation other(GetParam());
  const TetMesh ball = make_ball(0.25, 2);
  const AttachOptions options{.step = {.substeps = 30}};
  btSoftBody& twice = sim.add_jelly(ball, {.stiffness = 3, .attach = options});
  sim.penalty().attach(twice, make_elastic_field(ball.vertices, ball.tetrahedra, 4.0), options);
  btSoftBody& once = other.add_jelly(ball, {.stiffness = 7, .attach = options});
  for (btSoftBody* body : {&twice, &once}) body->m_nodes[20].m_x += btVector3(btScalar(0.0625), 0, 0);
  sim.step(exact_frame, 20);
  other.step(exact_frame, 20);
  EXPECT_EQ(sim.penalty().field(twice).num_elements(), 2 * other.penalty().field(once).num_elements());
  EXPECT_LT((sim.penalty().particles(twice).positions - other.penalty().particles(once).positions).norm(), 1e-9);
}

TEST_P(Attaching, AFurtherFieldWhileRunningCountsForTheSubsteps) {
  btSoftBody& body = sim.add_jelly(make_ball(0.25, 2));
  sim.step(exact_frame, 5);
  const int before = sim.penalty().report(body).substeps;
  const TetMesh ball = make_ball(0.25, 2);
  sim.penalty().attach(body, make_elastic_field(ball.vertices, ball.tetrahedra, 990.0),
                       {.step = {.integrator = Integrator::explicit_step}});
  sim.step(exact_frame, 5);
  EXPECT_NEAR(sim.penalty().report(body).substeps, 10 * before, 0.2 * 10 * before);  // frequencies grow tenfold
  EXPECT_TRUE(sim.penalty().report(body).finite);
}

TEST_P(Attaching, TwoBodiesHaveFieldsOfTheirOwn) {
  btSoftBody& soft = sim.add_jelly(make_ball(0.25, 2), {.stiffness = 1, .shift = {-1, 0, 0}});
  btSoftBody& stiff = sim.add_jelly(make_ball(0.25, 2), {.stiffness = 100, .shift = {1, 0, 0}});
  sim.step(exact_frame);
  EXPECT_NEAR(sim.penalty().report(stiff).substeps, 10 * sim.penalty().report(soft).substeps, 10);
  EXPECT_NE(&sim.penalty().field(soft), &sim.penalty().field(stiff));
}

// The field of a body that the application made, from Bullet's own links.
PotentialField field_of_links(const btSoftBody& body, Real stiffness) {
  Eigen::Matrix3Xd rest(3, body.m_nodes.size());
  for (int i = 0; i < body.m_nodes.size(); ++i) rest.col(i) = to_vector(body.m_nodes[i].m_x);
  std::vector<std::array<int, 2>> edges;
  edges.reserve(body.m_links.size());
  for (int l = 0; l < body.m_links.size(); ++l)
    edges.push_back({static_cast<int>(body.m_links[l].m_n[0] - &body.m_nodes[0]),
                     static_cast<int>(body.m_links[l].m_n[1] - &body.m_nodes[0])});
  PotentialField field(rest);
  field.add<Length>(edges, stiffness);
  return field;
}

TEST_P(Attaching, ABodyFromTrianglesOfTheApplicationBounces) {
  sim.set_gravity({0, -9.75, 0});
  sim.add_ground();
  const TetMesh ball = make_ball(0.25, 2);
  const auto faces = boundary_faces(ball.tetrahedra);
  std::vector<btScalar> vertices;
  for (const Real x : ball.vertices.reshaped()) vertices.push_back(static_cast<btScalar>(x));
  std::vector<int> triangles;
  for (const auto& face : faces) triangles.insert(triangles.end(), face.begin(), face.end());
  std::unique_ptr<btSoftBody> made(btSoftBodyHelpers::CreateFromTriMesh(sim.info(), vertices.data(), triangles.data(),
                                                                        static_cast<int>(faces.size())));
  made->translate(btVector3(0, btScalar(0.5), 0));
  made->setTotalMass(1);
  made->getCollisionShape()->setMargin(btScalar(0.02));
  btSoftBody& body = sim.add(std::move(made));
  ASSERT_GT(body.m_links.size(), 100);
  sim.penalty().attach(body, field_of_links(body, 5));
  Real low = 1e9;
  for (int step = 0; step < 64; ++step) {
    sim.step(exact_frame);
    ASSERT_TRUE(sim.penalty().report(body).finite);
    low = std::min(low, lowest(body));
  }
  EXPECT_GT(low, 0);
  EXPECT_LT(low, 0.03) << "did not reach the ground";
}

TEST_P(Attaching, AClothOfLinksHangsByItsPinnedCorners) {
  sim.set_gravity({0, -9.75, 0});
  std::unique_ptr<btSoftBody> made(btSoftBodyHelpers::CreatePatch(sim.info(), btVector3(-1, 2, -1), btVector3(1, 2, -1),
                                                                  btVector3(-1, 2, 1), btVector3(1, 2, 1), 11, 11,
                                                                  1 + 2, true));
  made->setTotalMass(1);
  btSoftBody& cloth = sim.add(std::move(made));
  std::vector<int> pinned;
  cloth.setMass(0, 0);
  cloth.setMass(10, 0);
  sim.penalty().attach(cloth, field_of_links(cloth, 5), {.step = {.damping_time = 0.01}});
  const btVector3 corner = cloth.m_nodes[0].m_x;
  sim.step(exact_frame, 256);
  EXPECT_EQ(cloth.m_nodes[0].m_x, corner);
  EXPECT_LT(lowest(cloth), 1) << "hangs";
  EXPECT_GT(lowest(cloth), -0.5) << "but is not torn";
  const std::vector<Real> strains =
      penalty::strains(sim.penalty().field(cloth), sim.penalty().particles(cloth).positions);
  EXPECT_LT(*std::max_element(strains.begin(), strains.end()), 0.3);
}

TEST_P(Attaching, BulletsLinksNoLongerActOnAnAttachedBody) {
  Simulation other(GetParam());
  const TetMesh ball = make_ball(0.25, 2);
  std::vector<btSoftBody*> bodies;
  for (Simulation* s : {&sim, &other}) {
    auto made = make_soft_body(s->info(), ball);
    if (s == &sim)
      for (const auto& [a, b] : edges_of(std::span<const Tetrahedron>(ball.tetrahedra))) made->appendLink(a, b);
    bodies.push_back(&s->add(std::move(made)));
    bodies.back()->m_nodes[20].m_x += btVector3(btScalar(0.0625), 0, 0);
    s->penalty().attach(*bodies.back(), make_elastic_field(ball.vertices, ball.tetrahedra, 10.0));
    s->step(exact_frame, 20);
  }
  EXPECT_EQ(sim.penalty().particles(*bodies[0]).positions, other.penalty().particles(*bodies[1]).positions);
}

INSTANTIATE_TEST_SUITE_P(World, Attaching, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
